"""Any number of configurations side by side, and the published figures beside them.

What each configuration measured of itself is gathered, then compared: the difference of each pair (eq. 3.2 of
Segerstedt 2021), and frame time as a straight line over the number of computations (his Table 6.1).
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path
from typing import Any

import yaml

from hobble.core.errors import InputError
from hobble.core.files import read_json
from hobble.evaluation.series import difference, line

COUNTS = ("true", "table_6_1", "table_6_1_as_printed")
FLOAT = 4  # bytes of a stored weight
PHASES = {"constant": 50, "linear": 10}  # whose weights the original stores


@dataclass(frozen=True)
class Measured:
    """What one configuration left behind: its resolved configuration, its measurements and its history."""

    name: str
    resolved: Mapping[str, Any] = field(repr=False)
    accuracy: Mapping[str, Any] = field(repr=False)
    rollouts: Mapping[str, Any] = field(repr=False)
    responsivity: Mapping[str, Any] = field(repr=False)
    injury: Mapping[str, Any] = field(repr=False)
    recognition: Mapping[str, Any] = field(repr=False)
    pipeline: Mapping[str, Any] = field(repr=False)
    history: Mapping[str, list[float | None]] = field(repr=False)


def read_measured(name: str, files: Mapping[str, str | Path]) -> Measured:
    """Read one configuration's files, named as the fields of `Measured` (`configuration` for `resolved`).

    Raises InputError naming the file that cannot be read.
    """
    read = {key: read_json(path) for key, path in files.items() if key not in ("configuration", "history")}
    resolved = yaml.safe_load(Path(files["configuration"]).read_text(encoding="utf-8"))
    return Measured(name, resolved, **read, history=_history(files["history"]))


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
        "accuracy": [{"dataset": _dataset(m), **m.accuracy, "configuration": m.name} for m in all_measured],
        "rollouts": [
            {"configuration": m.name, **{k: v for k, v in entry.items() if k != "clips"}}
            for m in all_measured
            for entry in m.rollouts["lengths"]
        ],
        "responsivity": [entry for m in all_measured for entry in _by_mode(m)],
        "injury": [_injury(m) for m in all_measured],
        "recognition": [{**m.recognition, "configuration": m.name} for m in all_measured],
        "training": [{"configuration": m.name, **m.history} for m in all_measured],
        "stages": [
            {"configuration": m.name, **{k: v for k, v in stage.items() if k != "rules"}}
            for m in all_measured
            for stage in m.pipeline["stages"]
        ],
        "difference": accuracy_differences(all_measured),
        "beside": _beside(all_measured, published),
        "milliseconds": {
            "difference": time_differences(all_measured),
            "fit": fits(all_measured, published),
            "beside": _beside_times(all_measured, published),
        },
        "published": dict(published),
    }


def describe(measured: Measured) -> dict[str, Any]:
    """What sets a configuration apart: its data, network, training, and the counts of Table 6.1."""
    model = measured.resolved["configuration"]
    counts = measured.responsivity["parameters"]
    phases = {mode: count * counts["true"] * FLOAT for mode, count in PHASES.items()}
    return {
        "configuration": measured.name,
        "dataset": _dataset(measured),
        "network_of": model.get("network_of"),
        "injury": bool(model.get("injury")),
        "hidden_layers": model["network"]["hidden_layers"],
        "units": model["network"]["units"],
        "passes": model["training"]["passes"],
        "joints": measured.accuracy["joints"],
        "computations": {key: counts[key] for key in COUNTS},
        "weights_bytes": {
            **phases,
            "cubic": model["network"]["control_points"] * counts["true"] * FLOAT,
        },
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
        theirs = {entry["mode"]: entry for entry in _by_mode(b)}
        for entry in _by_mode(a):
            if entry["mode"] in theirs:
                times = [
                    {"mean": e["milliseconds"]["total"], "sd": e["milliseconds"]["spread"]["sd"]}
                    for e in (entry, theirs[entry["mode"]])
                ]
                out.append({"a": a.name, "b": b.name, "over": entry["mode"], **_pair(*times)})
    return out


def fits(all_measured: Sequence[Measured], published: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Lines of milliseconds a frame over computations: of ours for each mode and step, and as published.

    `computations` says which of the counts; slope in milliseconds per computation. Configurations that read
    another's network, and those of one size, are points like any other.
    """
    out = []
    entries = [(m, entry) for m in all_measured for entry in _by_mode(m)]
    modes = list(dict.fromkeys(entry["mode"] for _, entry in entries))
    for counts in COUNTS:
        for mode in modes:
            for step in ("total", "predict"):
                points = [
                    (m.responsivity["parameters"][counts], entry["milliseconds"][step])
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


def _beside(all_measured: Sequence[Measured], published: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Published figures with ours, where a configuration of the name is among those compared."""
    found = {m.name: m for m in all_measured}
    out = []
    for row in published["accuracy"]:
        m = found.get(row["configuration"])
        for split in ("train", "held_out"):
            ours = m.accuracy[split]["mean_of_clips"] if m else None
            out.append(_row(f"relative error, {split} clips", row, row["mean"], ours, ""))
    for row in published["computations"]:
        counts = (
            found[row["configuration"]].responsivity["parameters"] if row["configuration"] in found else {}
        )
        out.append(_row("computations of Table 6.1", row, row["table_6_1"], counts.get(COUNTS[2]), ""))
        out.append(_row("parameters of a phase", row, row["parameters"], counts.get("true"), ""))
    for row in published["sizes"]:
        m = found.get(row["configuration"])
        ours = describe(m)["weights_bytes"]["constant"] if m else None
        out.append(_row("weights of 50 phases", row, row["weights"], ours, "bytes"))
        if "database" in row:
            ours = _stage(m, "database", "bytes") if m else None
            out.append(_row("database", row, row["database"], ours, "bytes"))
    people = published["recognition"]
    for m in all_measured:
        if m.recognition["applies"]:
            named = {**people, "configuration": m.name}
            ours = m.recognition["generated"]["right"]
            out.append(_row("hurt part named right (people; a classifier)", named, people["share"], ours, ""))
    return out


def _beside_times(all_measured: Sequence[Measured], published: Mapping[str, Any]) -> list[dict[str, Any]]:
    found = {m.name: m for m in all_measured}
    out = []
    for row in published["responsivity"]:
        m = found.get(row["configuration"])
        ours = m.responsivity["milliseconds"]["total"] if m else None
        out.append(_row("a frame", row, row["milliseconds"], ours, "ms"))
    for row in published["modes"]:
        for m in all_measured:
            times = {entry["mode"]: entry["milliseconds"]["predict"] for entry in _by_mode(m)}
            if row["mode"] in times:
                named = {**row, "configuration": m.name}
                out.append(
                    _row(f"a prediction, {row['mode']}", named, row["milliseconds"], times[row["mode"]], "ms")
                )
    for row in published["stages"]:
        for m in all_measured:
            named = {**row, "configuration": m.name}
            out.append(_row(row["stage"], named, row["seconds"], _stage(m, row["stage"], "seconds"), "s"))
    return out


def _row(
    measure: str, row: Mapping[str, Any], theirs: float, ours: float | None, unit: str
) -> dict[str, Any]:
    return {
        "measure": measure,
        "configuration": row["configuration"],
        "unit": unit,
        "published": theirs,
        "ours": ours,
        "source": row["source"],
    }


def _pair(a: Mapping[str, Any], b: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "mean_a": a["mean"],
        "sd_a": a["sd"],
        "mean_b": b["mean"],
        "sd_b": b["sd"],
        "difference": difference(a["mean"], a["sd"], b["mean"], b["sd"]),
    }


def _by_mode(measured: Measured) -> list[dict[str, Any]]:
    """The responsivity of each phase mode that was run."""
    found = measured.responsivity
    return [{**entry, "configuration": measured.name} for entry in found.get("modes", [found])]


def _injury(measured: Measured) -> dict[str, Any]:
    keys = ("applies", "reason", "summary")
    return {"configuration": measured.name, **{k: measured.injury[k] for k in keys if k in measured.injury}}


def _clips(measured: Measured) -> dict[str, Any]:
    return {entry["clip"]: entry for entry in measured.accuracy["clips"]}


def _dataset(measured: Measured) -> str:
    return measured.resolved["configuration"]["dataset"]


def _stage(measured: Measured, stage: str, key: str) -> float | None:
    return next((s[key] for s in measured.pipeline["stages"] if s["stage"] == stage), None)


def _history(path: str | Path) -> dict[str, list[float | None]]:
    columns: dict[str, list[float | None]] = {}
    try:
        with open(path, encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                for key, text in row.items():
                    columns.setdefault(key, []).append(float(text) if text else None)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(path, f"not a training history ({error})", fix="Train again.") from error
    return columns
