"""What the report shows of roll-outs: a chart of their errors. It is a part of the section on accuracy."""

from __future__ import annotations

from typing import Any

from hobble.measures.accuracy.page import COLOURS, NAMES
from hobble.measures.clip_parts import sample_in_words
from hobble.measures.inputs import Json
from hobble.report.gather import ReportMaterial
from hobble.report.parts import Chart, PageSection, SectionPart, axis, line_trace, log_axis


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The chart, which is added to the section on accuracy."""
    return PageSection("accuracy", [SectionPart(50, rollout_chart(found))])


def sample_note(found: Json) -> str:
    """Sentences about the measured sample and the error bars; empty if all clips were measured as a whole."""
    words = sample_in_words(found)
    return f" Measured on {words}. Whiskers are 95 % confidence intervals." if words else ""


def _error_bars(found: Json, split: str) -> dict[str, Any]:
    """Plotly error bars of the mean errors of a split: half widths of their 95 % confidence intervals."""
    entries = [entry[split] for entry in found["lengths"]]
    known = [entry for entry in entries if entry.get("position_error_cm") is not None]
    half_widths = [(entry.get("interval") or {}).get("position_error_cm", 0.0) for entry in known]
    return {"type": "data", "array": half_widths, "color": "@faint", "thickness": 1}


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
            error_bars = {"error_y": _error_bars(found, split)} if found.get("sample") else {}
            traces.append(line_trace(NAMES[split], x, y, COLOURS[split], mode="lines+markers", **error_bars))
    if not traces:
        return None
    return Chart(
        "rollouts",
        "Error when the network continues from its own poses",
        "Mean distance between a joint and its captured position. In a roll-out, the network continues from "
        "its own poses, as at run time. The horizontal axis shows the length of the roll-outs (60 frames are "
        "one second). If the line flattens, the character stays stable. A joint is drawn halfway between its "
        "predicted position and the position to which its predicted velocity takes it. This chart measures "
        "the drawn positions, before the feet are put on the ground. The charts above measure only the "
        "predicted position, so their error differs from the value at 1 frame in this chart."
        + sample_note(found),
        traces,
        {
            "xaxis": log_axis("frames", [x for trace in traces for x in trace["x"]]),
            "yaxis": axis("cm per joint", rangemode="tozero"),
        },
    )
