"""How the error grows when the figure is fed its own pose: in the section on accuracy."""

from __future__ import annotations

from hobble.measures.accuracy.page import COLOURS, NAMES
from hobble.measures.given import Json
from hobble.report.charts import Chart, axis, line, log_axis
from hobble.report.gather import Material
from hobble.report.parts import Part, Section


def section(found: Json, material: Material) -> Section:
    """The chart, a guest of the section on accuracy."""
    return Section("accuracy", [Part(50, rollout_chart(found))])


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
            traces.append(line(NAMES[split], x, y, COLOURS[split], mode="lines+markers"))
    if not traces:
        return None
    return Chart(
        "rollouts",
        "Fed its own pose",
        "Mean distance of a joint from the captured one when the network goes on from what it predicted "
        "itself, as at run time, over roll-outs of so many frames. A line that flattens is a figure that "
        "keeps to its feet; 60 frames are a second. This is the pose as drawn, halfway between the "
        "predicted position and where the predicted velocity carries the one before. The charts above take "
        "the predicted position alone, so their error of one frame is another.",
        traces,
        {
            "xaxis": log_axis("frames", [x for trace in traces for x in trace["x"]]),
            "yaxis": axis("cm a joint", rangemode="tozero"),
        },
    )
