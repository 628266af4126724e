"""Errors of roll-outs, in which the network continues from its own poses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from pydantic import Field

from hobble.core.files import Json
from hobble.core.section import Positive
from hobble.measures import measure
from hobble.measures.accuracy import COLOURS, NAMES
from hobble.measures.compare import ComparisonAddition, ConfigurationResults
from hobble.measures.measure import SPLITS, Row
from hobble.report import parts
from hobble.report.parts import SPLITS as SPLIT_LABELS
from hobble.report.parts import Chart, Compared, PageSection, SectionPart, Trace

if TYPE_CHECKING:
    from hobble.report.gather import ReportMaterial


class Options(measure.JointOptions, measure.SampleOptions):
    """The keys of this measurement in a configuration's section `evaluation`."""

    rollouts: tuple[Positive, ...] = Field(
        (1, 10, 60, 300), min_length=1, description="lengths of roll-outs, in frames"
    )


MEASURE = measure.Measure(
    name="rollouts",
    module=__name__,
    inputs=("weights", "clips", "summaries", "skeleton"),
    options=Options,
    runtime=("mode",),
    cost=measure.Cost(memory_mb=120, mb_per_1000_frames=27, seconds_per_1000_frames=0.6, least_minutes=30),
)
FRAMES_PER_SECOND = 60


def section(found: Json, material: ReportMaterial) -> PageSection:
    """The chart, which is added to the section on accuracy: how the error grows in roll-outs."""
    traces = [
        trace
        for split, name in NAMES.items()
        for trace in _error_line(name, found.get("lengths", ()), split, COLOURS[split])
    ]
    sample = measure.sample_in_words(found)
    shown = parts.chart("rollouts", traces, _layout(traces), more=["sample"] if sample else (), sample=sample)
    return PageSection("accuracy", [SectionPart(50, shown)])


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """A list entry for each configuration and length of roll-outs, without the errors of single clips."""
    return ComparisonAddition(
        entries=[
            {"configuration": m.name, **{k: v for k, v in entry.items() if k != "clips"}}
            for m in all_measured
            for entry in m.results_of("rollouts")["lengths"]
        ]
    )


def tables(compared: Json) -> dict[str, list[Row]]:
    """One table, with a row for each configuration, length and split."""
    rows: list[Row] = [
        {"configuration": entry["configuration"], "length": entry["length"], "split": split, **entry[split]}
        for entry in compared["rollouts"]
        for split in SPLITS
    ]
    return {"rollouts": rows}


def compared_section(compared: Compared) -> PageSection:
    """The chart, which is added to the section on accuracy."""
    return PageSection("accuracy", [SectionPart(20, compared_chart(compared))])


def compared_values(compared: Compared) -> Iterator[parts.ComparedValue]:
    """How far the joints are from the captured motion in roll-outs of about a second, and which are closest.

    The held-out clips are compared, or the training clips if there are no errors of held-out clips.
    """
    lengths = {row["length"] for row in compared["rollouts"]}
    length = min(lengths, key=lambda n: abs(n - FRAMES_PER_SECOND), default=None)
    rows = [row for row in compared["rollouts"] if row["length"] == length]
    for split, label in SPLIT_LABELS.items():
        errors = {row["configuration"]: (row[split] or {}).get("position_error_cm") for row in rows}
        if any(value is not None for value in errors.values()):
            of_what = f"in roll-outs of {length} frames on {label}"
            far = "the joints of {name} are {value} cm from the captured joints on average, " + of_what
            column = parts.Column.number("roll-out error, cm")
            yield parts.ComparedValue(25, column, errors, "Closest to captured motion", far)
            return


def compared_chart(compared: Compared) -> Chart:
    """How the error grows when the networks continue from their own poses."""
    options: dict[str, list[Trace]] = {}
    for split, label in SPLIT_LABELS.items():
        for name, colour in parts.configuration_colours(compared).items():
            rows = [r for r in compared.get("rollouts", ()) if r["configuration"] == name]
            if line := _error_line(name, rows, split, colour):
                options[label] = options.get(label, []) + line
    layout = _layout(trace for traces in options.values() for trace in traces)
    return parts.chart("compare-rollouts", layout=layout, choose="Clips", options=options)


def _error_line(name: str, entries: Iterable[Json], split: str, colour: str) -> list[Trace]:
    """The line of the mean error of a split over the length of roll-outs; [] if none was measured.

    entries: one for each length. If only a sample was measured, bars show 95 % confidence intervals.
    """
    known = [entry for entry in entries if (entry.get(split) or {}).get("position_error_cm") is not None]
    if not known:
        return []
    x, y = [entry["length"] for entry in known], [entry[split]["position_error_cm"] for entry in known]
    style: dict[str, Any] = {"mode": "lines+markers"}
    if widths := [e[split]["interval"]["position_error_cm"] for e in known if "interval" in e[split]]:
        style["error_y"] = {"type": "data", "array": widths, "color": "@faint", "thickness": 1}
    return [parts.line_trace(name, x, y, colour, **style)]


def _layout(traces: Iterable[Trace]) -> dict[str, Any]:
    lengths = [x for trace in traces for x in trace["x"]]
    return {
        "xaxis": parts.log_axis("frames", lengths),
        "yaxis": parts.axis("cm per joint", rangemode="tozero"),
    }
