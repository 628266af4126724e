"""Writes rows as CSV files."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from hobble.core.files import write_text


def write_csv(path: str | Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows. None, or a key that only other rows have, is an empty field; no rows are an empty file."""
    out = io.StringIO()
    if rows:
        writer = csv.DictWriter(
            out, fieldnames=list(dict.fromkeys(key for row in rows for key in row)), lineterminator="\n"
        )
        writer.writeheader()
        writer.writerows(rows)
    write_text(path, out.getvalue())


def write_tables(folder: str | Path, tables: Mapping[str, Sequence[Mapping[str, Any]]]) -> None:
    """Write each table to <folder>/<name>.csv. Creates the folder."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    for name, rows in tables.items():
        write_csv(Path(folder) / f"{name}.csv", rows)
