"""Roll-outs of configurations side by side: in the section on accuracy."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from hobble.report.charts import Chart, Trace, axis, line, log_axis
from hobble.report.formats import number
from hobble.report.parts import Part, Section
from hobble.report.side_by_side import SPLITS, Compared, colours
from hobble.report.verdicts import Verdict, best

SECOND = 60  # frames


def section(compared: Compared) -> Section:
    """The chart, a guest of the section on accuracy."""
    return Section("accuracy", [Part(20, rollout_chart(compared))])


def verdicts(compared: Compared) -> Iterator[Verdict]:
    """Which stays closest to the captured motion over the roll-outs of about a second."""
    length = min({row["length"] for row in compared["rollouts"]}, key=lambda n: abs(n - SECOND), default=None)
    rows = [row for row in compared["rollouts"] if row["length"] == length]
    for split, label in SPLITS.items():
        off = {row["configuration"]: (row[split] or {}).get("position_error_cm") for row in rows}
        if any(value is not None for value in off.values()):
            where = f"cm from where they were in {label}, on the average of {length} frames of its own"
            yield from best(
                10,
                "Closest to captured motion",
                off,
                partial(_off, where),
            )
            return


def _off(where: str, name: str, value: float) -> str:
    return f"the joints of {name} are {number(value, 3)} {where}"


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
