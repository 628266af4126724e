"""How the error grows when the figure is fed its own pose: in the section on accuracy."""

from __future__ import annotations

from typing import Any

from hobble.measures.accuracy.page import COLOURS, NAMES
from hobble.measures.given import Json
from hobble.report.charts import Chart, axis, line, log_axis
from hobble.report.gather import Material
from hobble.report.parts import Part, Section


def section(found: Json, material: Material) -> Section:
    """The chart, a guest of the section on accuracy."""
    return Section("accuracy", [Part(50, rollout_chart(found))])


def sampled(found: Json) -> str:
    """A sentence on which clips were measured, where not all of them were; else nothing."""
    sample = found.get("sample")
    if not sample:
        return ""
    return (
        f" Measured on {sample['clips']:,} of {sample['of']:,} clips, drawn by gait, speed, channel and "
        "split. Whiskers are 95 % confidence intervals."
    )


def _whiskers(found: Json, split: str) -> dict[str, Any]:
    """Half widths of the intervals, for each length that has a mean."""
    entries = [entry[split] for entry in found["lengths"]]
    known = [entry for entry in entries if entry.get("position_error_cm") is not None]
    widths = [(entry.get("interval") or {}).get("position_error_cm", 0.0) for entry in known]
    return {"type": "data", "array": widths, "color": "@faint", "thickness": 1}


def rollout_chart(found: Json) -> Chart | None:
    """How the error grows when the figure is fed its own pose."""
    traces = []
    for split in ("held_out", "train"):
        rows = [
            (entry["length"], entry[split]["position_error_cm"])
            for entry in found.get("lengths", ())
            if (entry.get(split) or {}).get("position_error_cm") is not None
        ]
        if rows:
            x, y = zip(*rows, strict=True)
            whiskers = {"error_y": _whiskers(found, split)} if found.get("sample") else {}
            traces.append(line(NAMES[split], x, y, COLOURS[split], mode="lines+markers", **whiskers))
    if not traces:
        return None
    return Chart(
        "rollouts",
        "Fed its own pose",
        "Mean distance of a joint from the captured one when the network goes on from what it predicted "
        "itself, as at run time, over roll-outs of so many frames. A line that flattens is a figure that "
        "keeps to its feet; 60 frames are a second. This is the pose as drawn, halfway between the "
        "predicted position and where the predicted velocity carries the one before. The charts above take "
        "the predicted position alone, so their error of one frame is another." + sampled(found),
        traces,
        {
            "xaxis": log_axis("frames", [x for trace in traces for x in trace["x"]]),
            "yaxis": axis("cm a joint", rangemode="tozero"),
        },
    )
