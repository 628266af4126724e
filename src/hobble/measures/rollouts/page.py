"""How the error grows when the network continues from its own poses; part of the section on accuracy."""

from __future__ import annotations

from typing import Any

from hobble.measures.accuracy.page import COLOURS, NAMES
from hobble.measures.clip_parts import sample_in_words
from hobble.measures.inputs import Json
from hobble.report.charts import Chart, axis, line, log_axis
from hobble.report.gather import ReportMaterial
from hobble.report.page_parts import PageSection, SectionPart


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The chart, which is added to the section on accuracy."""
    return PageSection("accuracy", [SectionPart(50, rollout_chart(found))])


def sampled(found: Json) -> str:
    """Sentences on the measured sample and on the error bars; empty if all clips were measured."""
    words = sample_in_words(found)
    return f" Measured on {words}. Whiskers are 95 % confidence intervals." if words else ""


def _whiskers(found: Json, split: str) -> dict[str, Any]:
    """Error bars of the mean errors: half the width of each confidence interval."""
    entries = [entry[split] for entry in found["lengths"]]
    known = [entry for entry in entries if entry.get("position_error_cm") is not None]
    widths = [(entry.get("interval") or {}).get("position_error_cm", 0.0) for entry in known]
    return {"type": "data", "array": widths, "color": "@faint", "thickness": 1}


def rollout_chart(found: Json) -> Chart | None:
    """How the error grows when the network continues from its own poses."""
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
        "Error when the network continues from its own poses",
        "Mean distance between a joint and its captured position in roll-outs, in which the network "
        "continues from its own poses, as at run time. Their length is on the horizontal axis (60 frames are "
        "one second). If the line flattens, the "
        "character stays stable. This chart measures the pose as drawn. A joint is drawn halfway "
        "between its predicted position and the position to which its predicted velocity takes it. "
        "The charts above measure only the predicted position, so their error differs from the value at "
        "1 frame in this chart." + sampled(found),
        traces,
        {
            "xaxis": log_axis("frames", [x for trace in traces for x in trace["x"]]),
            "yaxis": axis("cm per joint", rangemode="tozero"),
        },
    )
