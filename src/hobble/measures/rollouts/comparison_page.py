"""What the page of a comparison shows of roll-outs. It is a part of the section on accuracy."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from hobble.report.parts import (
    SPLITS,
    Chart,
    Compared,
    PageSection,
    SectionPart,
    Trace,
    Verdict,
    axis,
    configuration_colours,
    format_number,
    line_trace,
    log_axis,
    verdict_on_lowest,
)

FRAMES_PER_SECOND = 60


def section(compared: Compared) -> PageSection:
    """The chart, which is added to the section on accuracy."""
    return PageSection("accuracy", [SectionPart(20, rollout_chart(compared))])


def verdicts(compared: Compared) -> Iterator[Verdict]:
    """Which configuration stays closest to the captured motion in roll-outs of about a second.

    The held-out clips are compared, or the training clips if there are no errors of held-out clips.
    """
    lengths = {row["length"] for row in compared["rollouts"]}
    length = min(lengths, key=lambda n: abs(n - FRAMES_PER_SECOND), default=None)
    rows = [row for row in compared["rollouts"] if row["length"] == length]
    for split, label in SPLITS.items():
        errors = {row["configuration"]: (row[split] or {}).get("position_error_cm") for row in rows}
        if any(value is not None for value in errors.values()):
            ending = f"cm from the captured joints on average, in roll-outs of {length} frames on {label}"
            yield from verdict_on_lowest(
                10,
                "Closest to captured motion",
                errors,
                partial(_distance_words, ending),
            )
            return


def _distance_words(ending: str, name: str, value: float) -> str:
    """Half of a sentence: the mean distance `value` of the configuration `name`, followed by `ending`."""
    return f"the joints of {name} are {format_number(value, 3)} {ending}"


def rollout_chart(compared: Compared) -> Chart | None:
    """How the error grows when the networks continue from their own poses."""
    options: dict[str, list[Trace]] = {}
    for split, label in SPLITS.items():
        traces = []
        for name, colour in configuration_colours(compared).items():
            rows = [r for r in compared.get("rollouts", ()) if r["configuration"] == name]
            rows = [r for r in rows if (r[split] or {}).get("position_error_cm") is not None]
            if rows:
                x = [row["length"] for row in rows]
                y = [row[split]["position_error_cm"] for row in rows]
                traces.append(line_trace(name, x, y, colour, mode="lines+markers"))
        if traces:
            options[label] = traces
    if not options:
        return None
    return Chart(
        "compare-rollouts",
        "Error when a network continues from its own poses",
        "Mean distance between a joint and its captured position. In a roll-out, a network continues from "
        "its own poses. The horizontal axis shows the length of the roll-outs (60 frames are one second).",
        layout={
            "xaxis": log_axis(
                "frames", [x for traces in options.values() for trace in traces for x in trace["x"]]
            ),
            "yaxis": axis("cm per joint", rangemode="tozero"),
        },
        choose="Clips",
        options=options,
    )
