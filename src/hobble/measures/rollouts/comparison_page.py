"""Roll-outs of configurations side by side: in the section on accuracy."""

from __future__ import annotations

from hobble.report.charts import Chart, Trace, axis, line, log_axis
from hobble.report.parts import Part, Section
from hobble.report.side_by_side import SPLITS, Compared, colours


def section(compared: Compared) -> Section:
    """The chart, a guest of the section on accuracy."""
    return Section("accuracy", [Part(20, rollout_chart(compared))])


def rollout_chart(compared: Compared) -> Chart | None:
    """How the error grows when the figure is fed its own pose."""
    options: dict[str, list[Trace]] = {}
    for split, label in SPLITS.items():
        traces = []
        for name, colour in colours(compared).items():
            rows = [r for r in compared.get("rollouts", ()) if r["configuration"] == name]
            rows = [r for r in rows if (r[split] or {}).get("position_error_cm") is not None]
            if rows:
                x = [row["length"] for row in rows]
                y = [row[split]["position_error_cm"] for row in rows]
                traces.append(line(name, x, y, colour, mode="lines+markers"))
        if traces:
            options[label] = traces
    if not options:
        return None
    return Chart(
        "compare-rollouts",
        "Fed its own pose",
        "Mean distance of a joint from the captured one, over roll-outs of so many frames in which the "
        "network goes on from what it predicted itself. One frame is the error above.",
        layout={
            "xaxis": log_axis("frames", [x for t in options.values() for one in t for x in one["x"]]),
            "yaxis": axis("cm a joint", rangemode="tozero"),
        },
        choose="Over",
        options=options,
    )
