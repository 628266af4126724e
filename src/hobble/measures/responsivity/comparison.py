"""Compares the frame times and network sizes of configurations, and fits straight lines of time over size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import TypedDict

import numpy as np

from hobble.evaluation.comparison_csv import flatten
from hobble.evaluation.comparison_rows import (
    ComparisonAddition,
    DifferenceOf,
    PublishedRow,
    compare_series,
    published_row,
)
from hobble.evaluation.configuration_results import ConfigurationResults
from hobble.evaluation.series import StraightLine, fit_line
from hobble.measures.inputs import Json, Row

NAME = "responsivity"
# The timed steps of a frame, and "total", the whole frame.
STEPS = ("prepare", "input", "insert", "predict", "output", "update", "total")
# Three ways to count the weights and biases that one frame uses, explained at `parameter_counts` in
# hobble.measures.responsivity.run. compare.json calls such a count "computations".
COUNTS = ("true", "table_6_1", "table_6_1_as_printed")


class Sizes(TypedDict):
    """The size of a network.

    computations: name in COUNTS -> that count of weights and biases, None for a network without layers.
    weights_bytes: phase mode -> bytes of weights in memory. exact: the phase mode that approximates nothing.
    """

    computations: dict[str, int | None]
    weights_bytes: dict[str, int]
    exact: str


class TimeLine(StraightLine):
    """A straight line fitted to times `y` (ms) over counts of computations `x`, one point per configuration.

    slope, intercept and r2 are None if all x are equal. whose: whose times, "hobble" or "published". mode:
    phase mode; None for published times. step, computations: which times and which counts, see `fit_lines`.
    """

    whose: str
    mode: str | None
    step: str
    computations: str
    x: list[int]
    y: list[float]


def compared(all_measured: Sequence[ConfigurationResults], published: Json) -> ComparisonAddition:
    """The laps of the track in each phase mode, the networks' sizes, and published sizes and times."""
    sizes = {m.name: _sizes(m) for m in all_measured}
    return ComparisonAddition(
        entries=[entry for m in all_measured for entry in mode_entries(m)],
        about=sizes,
        against_published=_published_sizes(sizes, published),
        milliseconds={
            "difference": time_differences(all_measured),
            "fit": fit_lines(all_measured, published),
            "against_published": _published_times(all_measured, published),
        },
    )


def tables(compared: Json) -> dict[str, Sequence[Row]]:
    """Two tables: every lap; the lines of time over size, without their points."""
    fit = compared["milliseconds"]["fit"]
    return {
        NAME: [lap for entry in compared[NAME] for lap in _lap_rows(entry)],
        "fit": [{k: v for k, v in row.items() if k not in ("x", "y")} for row in fit],
    }


def mode_entries(results: ConfigurationResults) -> list[Json]:
    """A configuration's results in each phase mode that was run. The key `configuration` has its name."""
    found = results.results_of(NAME)
    return [{**entry, "configuration": results.name} for entry in found.get("modes", [found])]


def _sizes(results: ConfigurationResults) -> Sizes:
    found = results.results_of(NAME)
    counts = found["parameters"]
    return {
        "computations": {key: counts[key] if counts else None for key in COUNTS},
        "weights_bytes": {mode: count * found["bytes_each"] for mode, count in found["stored"].items()},
        "exact": found["exact"],
    }


def time_differences(all_measured: Sequence[ConfigurationResults]) -> list[DifferenceOf]:
    """How much the frame times of any two configurations differ, in each phase mode that both have run.

    The difference is computed by eq. 3.2 of Segerstedt (2021), see `pair`.
    """
    out: list[DifferenceOf] = []
    for a, b in combinations(all_measured, 2):
        entries_of_b = {entry["mode"]: entry for entry in mode_entries(b)}
        for entry in mode_entries(a):
            if entry["mode"] in entries_of_b:
                times = [
                    {
                        "mean": e["milliseconds"]["total"],
                        "sd": e["milliseconds"]["spread"]["sd"],
                        "means": lap_means(e),
                    }
                    for e in (entry, entries_of_b[entry["mode"]])
                ]
                out.append({"a": a.name, "b": b.name, "over": entry["mode"], **compare_series(*times)})
    return out


def fit_lines(all_measured: Sequence[ConfigurationResults], published: Json) -> list[TimeLine]:
    """Straight lines of milliseconds per frame over computations, for our times and for the published times.

    computations: one of COUNTS. step: which time is fitted. "total" is the mean time of a whole frame; the
    published times are such means. "predict" is the mean time of the step `predict`. "median" is the median
    time of a whole frame; other programs on the machine change it least. slope: milliseconds per computation.
    Configurations with the same network are separate points. Networks without layers are left out.
    """
    out = []
    entries = [
        (m, entry) for m in all_measured if m.results_of(NAME)["parameters"] for entry in mode_entries(m)
    ]
    modes = list(dict.fromkeys(entry["mode"] for _, entry in entries))
    for counts in COUNTS:
        for mode in modes:
            for step in ("total", "predict", "median"):
                points = [
                    (m.results_of(NAME)["parameters"][counts], _time(entry["milliseconds"], step))
                    for m, entry in entries
                    if entry["mode"] == mode
                ]
                out.append(_fit("hobble", mode, step, counts, points))
    times = {row["configuration"]: row["milliseconds"] for row in published["responsivity"]}
    for counts, key in (("true", "parameters"), ("table_6_1_as_printed", "table_6_1")):
        points = [
            (row[key], times[row["configuration"]])
            for row in published["computations"]
            if row["configuration"] in times
        ]
        out.append(_fit("published", None, "total", counts, points))
    return out


def _time(milliseconds: Json, step: str) -> float:
    """The time of a `step` of `fit_lines`, ms. milliseconds: the entry of that name in responsivity.json."""
    return (milliseconds["spread"] if step == "median" else milliseconds)[step]


def _fit(whose: str, mode: str | None, step: str, counts: str, points: list[tuple[int, float]]) -> TimeLine:
    """The line through `points`: (computations, ms) of each configuration. For the rest see `TimeLine`."""
    unfitted: StraightLine = {"slope": None, "intercept": None, "r2": None, "points": len(points)}
    fitted = fit_line([x for x, _ in points], [y for _, y in points])
    return {
        "whose": whose,
        "mode": mode,
        "step": step,
        "computations": counts,
        "x": [x for x, _ in points],
        "y": [y for _, y in points],
        **(fitted or unfitted),
    }


def lap_means(entry: Json) -> list[float]:
    """Milliseconds per frame of each lap, all steps together."""
    return [lap["milliseconds"]["total"] for lap in entry["laps"]]


def _published_sizes(sizes_of: Mapping[str, Sizes], published: Json) -> list[PublishedRow]:
    """Published sizes of networks next to ours. sizes_of: configuration -> sizes of its network."""
    out = []
    for row in published["computations"]:
        sizes = sizes_of.get(row["configuration"])
        counts = sizes["computations"] if sizes else {}
        in_table = {**row, "table": "6.1"}
        out.append(
            published_row(
                "computations of Table 6.1", in_table, row["table_6_1"], counts.get("table_6_1_as_printed")
            )
        )
        out.append(published_row("parameters of a phase", row, row["parameters"], counts.get("true")))
    for row in published["stages"]:
        if row["stage"] == "training" and "bytes" in row:
            sizes = sizes_of.get(row["configuration"])
            # The published weights are those of the constant mode, which stores the weights of 50 phases.
            ours = sizes["weights_bytes"].get("constant") if sizes else None
            out.append(published_row("weights of 50 phases", row, row["bytes"], ours, "bytes"))
    return out


def _published_times(all_measured: Sequence[ConfigurationResults], published: Json) -> list[PublishedRow]:
    """Published times next to ours: of a frame, and of a prediction in each phase mode."""
    by_name = {m.name: m for m in all_measured}
    out = []
    for row in published["responsivity"]:
        results = by_name.get(row["configuration"])
        ours = results.results_of(NAME)["milliseconds"]["total"] if results else None
        out.append(published_row("a frame", row, row["milliseconds"], ours, "ms"))
        if "sd" in row:
            in_text = {**row, "table": None}  # the standard deviation is only in the text of the thesis
            means = lap_means(results.results_of(NAME)) if results else []
            sd = float(np.std(means)) if len(means) > 1 else None
            out.append(published_row("standard deviation of the means of laps", in_text, row["sd"], sd, "ms"))
    for row in published["modes"]:
        results = by_name.get(row["configuration"])
        entries = mode_entries(results) if results else []
        times = {entry["mode"]: entry["milliseconds"]["predict"] for entry in entries}
        what = f"a prediction, {row['mode']}"
        out.append(published_row(what, row, row["milliseconds"], times.get(row["mode"]), "ms"))
    return out


def _lap_rows(entry: Json) -> list[Row]:
    """A row for each lap in one phase mode. entry: from `mode_entries`."""
    head = {"configuration": entry["configuration"], "mode": entry["mode"]}
    rows: list[Row] = []
    for lap in entry["laps"]:
        times = lap["milliseconds"]
        row = {key: value for key, value in lap.items() if key != "milliseconds"}
        row |= {f"milliseconds_{step}": times[step] for step in STEPS}
        row |= {f"milliseconds_{step}_sd": sd for step, sd in times["sd"].items()}
        rows.append({**head, **row, **{f"milliseconds_{k}": v for k, v in flatten(times["spread"]).items()}})
    return rows
