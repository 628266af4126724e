"""The comparison as flat tables, one for each CSV file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hobble.evaluation.compare_configurations import each
from hobble.measures.inputs import Json, Row


def tables(compared: Json) -> dict[str, Sequence[Row]]:
    """Table name -> rows with equal keys, from the result of `compare`."""
    of_measures = {name: rows for _, make in each("tables") for name, rows in make(compared).items()}
    return {
        "configurations": [flat(row) for row in compared["configurations"]],
        **of_measures,
        "training": _training(compared),
        "stages": list(compared["stages"]),
        "difference": [
            {"measure": measure, **row}
            for measure, rows in (
                ("relative error", compared["difference"]),
                ("milliseconds a frame", compared["milliseconds"].get("difference", ())),
            )
            for row in rows
        ],
        "published": [*compared["against_published"], *compared["milliseconds"]["against_published"]],
    }


def flat(row: Row) -> Row:
    """A row in which each inner mapping is replaced by keys `key_inner`."""
    out: dict[str, object] = {}
    for key, value in row.items():
        if isinstance(value, Mapping):
            out |= {f"{key}_{inner}": v for inner, v in value.items()}
        else:
            out[key] = value
    return out


def _training(compared: Json) -> list[Row]:
    rows: list[Row] = []
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
