"""The comparison as flat rows, one table a CSV file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hobble.evaluation.accuracy import COLUMNS, SPLITS
from hobble.evaluation.recognition import rows as recognition_rows

STEPS = ("prepare", "input", "insert", "predict", "output", "update", "total")


def tables(compared: Mapping[str, Any]) -> dict[str, list[dict[str, Any]]]:
    """Table name -> rows of equal keys, of what `compare.compare` returned."""
    return {
        "configurations": [_flat(row) for row in compared["configurations"]],
        "accuracy": [
            {"configuration": entry["configuration"], **{key: clip.get(key) for key in COLUMNS}}
            for entry in compared["accuracy"]
            for clip in entry["clips"]
        ],
        "rollouts": [
            {
                "configuration": entry["configuration"],
                "length": entry["length"],
                "split": split,
                **entry[split],
            }
            for entry in compared["rollouts"]
            for split in SPLITS
        ],
        "recognition": [
            {"configuration": entry["configuration"], **row}
            for entry in compared["recognition"]
            for row in recognition_rows(entry)
        ],
        "responsivity": [lap for entry in compared["responsivity"] for lap in _laps(entry)],
        "training": _training(compared),
        "stages": list(compared["stages"]),
        "difference": [
            {"measure": measure, **row}
            for measure, rows in (
                ("relative error", compared["difference"]),
                ("milliseconds a frame", compared["milliseconds"]["difference"]),
            )
            for row in rows
        ],
        "fit": [
            {k: v for k, v in row.items() if k not in ("x", "y")} for row in compared["milliseconds"]["fit"]
        ],
        "published": [*compared["beside"], *compared["milliseconds"]["beside"]],
    }


def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, Mapping):
            out |= {f"{key}_{inner}": v for inner, v in value.items()}
        else:
            out[key] = value
    return out


def _laps(entry: Mapping[str, Any]) -> list[dict[str, Any]]:
    head = {"configuration": entry["configuration"], "mode": entry["mode"]}
    rows = []
    for lap in entry["laps"]:
        times = lap["milliseconds"]
        row = {key: value for key, value in lap.items() if key != "milliseconds"}
        row |= {f"milliseconds_{step}": times[step] for step in STEPS}
        row |= {f"milliseconds_{step}_sd": sd for step, sd in times["sd"].items()}
        rows.append({**head, **row, **{f"milliseconds_{k}": v for k, v in _flat(times["spread"]).items()}})
    return rows


def _training(compared: Mapping[str, Any]) -> list[dict[str, Any]]:
    rows = []
    names = list(dict.fromkeys(key for entry in compared["training"] for key in entry))
    for entry in compared["training"]:
        for i in range(len(entry.get("pass", ()))):
            rows.append(
                {
                    name: entry[name] if name == "configuration" else entry.get(name, [None] * (i + 1))[i]
                    for name in names
                }
            )
    return rows
