"""Any number of configurations side by side, and the published figures beside them.

What each configuration measured of itself is gathered, then compared: the difference of each pair (eq. 3.2 of
Segerstedt 2021), and frame time as a straight line over the number of computations (his Table 6.1).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

from hobble.evaluation.beside import beside, beside_times
from hobble.evaluation.measured import COUNTS, Measured, by_mode, dataset, describe
from hobble.evaluation.series import difference, line


def compare(all_measured: Sequence[Measured], published: Mapping[str, Any]) -> dict[str, Any]:
    """compare.json: lists with an entry for each configuration, in their order.

    `configurations`, `accuracy`, `rollouts`, `responsivity`, `injury`, `recognition`, `training`, `stages`:
    what each measured;
    `difference`: eq. 3.2 of the relative errors of each pair; `beside`: the published figures with ours;
    `published`: all of them. Whatever a frame's time decides stands under `milliseconds`: `difference`, `fit`
    and `beside` again.
    """
    return {
        "configurations": [describe(m) for m in all_measured],
        "accuracy": [{"dataset": dataset(m), **m.accuracy, "configuration": m.name} for m in all_measured],
        "rollouts": [
            {"configuration": m.name, **{k: v for k, v in entry.items() if k != "clips"}}
            for m in all_measured
            for entry in m.rollouts["lengths"]
        ],
        "responsivity": [entry for m in all_measured for entry in by_mode(m)],
        "injury": [_injury(m) for m in all_measured],
        "recognition": [{**m.recognition, "configuration": m.name} for m in all_measured],
        "training": [{"configuration": m.name, **m.history} for m in all_measured],
        "stages": [
            {"configuration": m.name, **{k: v for k, v in stage.items() if k != "rules"}}
            for m in all_measured
            for stage in m.pipeline["stages"]
        ],
        "difference": accuracy_differences(all_measured),
        "beside": beside(all_measured, published),
        "milliseconds": {
            "difference": time_differences(all_measured),
            "fit": fits(all_measured, published),
            "beside": beside_times(all_measured, published),
        },
        "published": dict(published),
    }


def accuracy_differences(all_measured: Sequence[Measured]) -> list[dict[str, Any]]:
    """Eq. 3.2 of each pair: over each split, and for each clip that both were measured on."""
    out = []
    for a, b in combinations(all_measured, 2):
        ours = {**{s: a.accuracy[s] for s in ("train", "held_out")}, **_clips(a)}
        theirs = {**{s: b.accuracy[s] for s in ("train", "held_out")}, **_clips(b)}
        for over in ours:
            if over in theirs and ours[over]["frames"] and theirs[over]["frames"]:
                out.append({"a": a.name, "b": b.name, "over": over, **_pair(ours[over], theirs[over])})
    return out


def time_differences(all_measured: Sequence[Measured]) -> list[dict[str, Any]]:
    """Eq. 3.2 of the frame times of each pair, in the modes that both were run in."""
    out = []
    for a, b in combinations(all_measured, 2):
        theirs = {entry["mode"]: entry for entry in by_mode(b)}
        for entry in by_mode(a):
            if entry["mode"] in theirs:
                times = [
                    {"mean": e["milliseconds"]["total"], "sd": e["milliseconds"]["spread"]["sd"]}
                    for e in (entry, theirs[entry["mode"]])
                ]
                out.append({"a": a.name, "b": b.name, "over": entry["mode"], **_pair(*times)})
    return out


def fits(all_measured: Sequence[Measured], published: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Lines of milliseconds a frame over computations: of ours for each mode and step, and as published.

    `computations` says which of the counts, `step` what of a frame: the mean of `total`, as published, or of
    `predict`, or the `median` of the total, which a busy machine moves least. Slope in milliseconds per
    computation. Configurations that read another's network, and those of one size, are points like any other.
    """
    out = []
    entries = [(m, entry) for m in all_measured for entry in by_mode(m)]
    modes = list(dict.fromkeys(entry["mode"] for _, entry in entries))
    for counts in COUNTS:
        for mode in modes:
            for step in ("total", "predict", "median"):
                points = [
                    (m.responsivity["parameters"][counts], _time(entry["milliseconds"], step))
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


def _time(milliseconds: Mapping[str, Any], step: str) -> float:
    return (milliseconds["spread"] if step == "median" else milliseconds)[step]


def _fit(
    whose: str, mode: str | None, step: str, counts: str, points: list[tuple[int, float]]
) -> dict[str, Any]:
    found = line([x for x, _ in points], [y for _, y in points])
    return {
        "whose": whose,
        "mode": mode,
        "step": step,
        "computations": counts,
        "x": [x for x, _ in points],
        "y": [y for _, y in points],
        **(found or {"slope": None, "intercept": None, "r2": None, "points": len(points)}),
    }


def _pair(a: Mapping[str, Any], b: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "mean_a": a["mean"],
        "sd_a": a["sd"],
        "mean_b": b["mean"],
        "sd_b": b["sd"],
        "difference": difference(a["mean"], a["sd"], b["mean"], b["sd"]),
    }


def _injury(measured: Measured) -> dict[str, Any]:
    keys = ("applies", "reason", "summary")
    return {"configuration": measured.name, **{k: measured.injury[k] for k in keys if k in measured.injury}}


def _clips(measured: Measured) -> dict[str, Any]:
    return {entry["clip"]: entry for entry in measured.accuracy["clips"]}
