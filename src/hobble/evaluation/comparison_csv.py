"""The comparison as flat tables, one for each CSV file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from hobble.evaluation.compare_configurations import comparison_functions
from hobble.measures.inputs import Json, Row


def comparison_tables(compared: Json) -> dict[str, Sequence[Row]]:
    """Table name -> rows, from the content of compare.json. The rows of a table have the same keys."""
    measure_tables = {
        name: rows
        for _, make_tables in comparison_functions("tables")
        for name, rows in make_tables(compared).items()
    }
    return {
        "configurations": [flatten(row) for row in compared["configurations"]],
        **measure_tables,
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


def flatten(row: Row) -> Row:
    """The row without mappings as values: the entry `b` of a mapping under the key `a` gets the key `a_b`."""
    out: dict[str, object] = {}
    for key, value in row.items():
        if isinstance(value, Mapping):
            out |= {f"{key}_{inner}": v for inner, v in value.items()}
        else:
            out[key] = value
    return out


def _training(compared: Json) -> list[Row]:
    """A row for each pass of each training. A value that the training did not record is None."""
    rows: list[Row] = []
    columns = list(dict.fromkeys(key for entry in compared["training"] for key in entry))
    for entry in compared["training"]:
        for i in range(len(entry.get("pass", ()))):
            rows.append(
                {
                    column: entry[column]
                    if column == "configuration"
                    else entry.get(column, [None] * (i + 1))[i]
                    for column in columns
                }
            )
    return rows
