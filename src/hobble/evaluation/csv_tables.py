"""Tables as CSV files, read and written with pandas."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hobble.core.errors import InputError
from hobble.core.files import write_text
from hobble.core.untrusted import read_text

if TYPE_CHECKING:
    import pandas


def data_frame(rows: Sequence[Mapping[str, Any]]) -> pandas.DataFrame:
    """A data frame with a row for each mapping of `rows`. Columns are in the order in which they first occur.

    Values keep their types. An integer does not become a float if its column has no value in another row.
    """
    import pandas  # here, because the import takes 0.3 s and most jobs write no table

    columns = list(dict.fromkeys(key for row in rows for key in row))
    return pandas.DataFrame(
        [[row.get(key) for key in columns] for row in rows], columns=columns, dtype=object
    )


def write_csv(path: str | Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a CSV file with a header and a line for each row. Without rows, the file is empty.

    A field is empty if its value is missing, None or NaN.
    """
    write_text(path, data_frame(rows).to_csv(index=False, lineterminator="\n") if rows else "")


def write_tables(folder: str | Path, tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    """Write each table to <folder>/<name>.csv. Creates the folder. tables: name -> rows."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name, rows in tables.items():
        write_csv(Path(folder) / f"{name}.csv", rows)


def read_numbers(path: str | Path) -> dict[str, list[float | None]]:
    """Read a CSV file of numbers, such as history.csv, as column -> values.

    The value of an empty, NaN or infinite cell is None. Raises InputError, which names the column and quotes
    the cell, if a cell is not a number.
    """
    import pandas

    try:
        table = pandas.read_csv(
            io.StringIO(read_text(path)), dtype=str, keep_default_na=False, index_col=False
        )
    except (pandas.errors.EmptyDataError, pandas.errors.ParserError) as error:
        raise InputError(
            path, f"not a table of numbers ({error})", fix="Delete the file and run again."
        ) from None
    return {str(name): [_number(path, str(name), text) for text in table[name]] for name in table.columns}


def _number(path: str | Path, column: str, text: Any) -> float | None:
    """The number in a cell; None if it is empty, NaN or infinite. text: NaN if the line has too few cells."""
    if not isinstance(text, str) or not text.strip():
        return None
    try:
        value = float(text)
    except ValueError:
        problem = f"column {column} holds {text!r:.80}, which is not a number"
        raise InputError(path, problem, fix="Delete the file and run again.") from None
    return value if abs(value) < float("inf") else None
