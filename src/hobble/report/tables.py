"""Tables, which the reader of a page can sort and save as CSV."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from hobble.report.formats import format_number


@dataclass(frozen=True)
class Column:
    """A column of a table.

    label: its heading. show: a function from a value to the text in the cell. kind: its CSS class. Columns of
    the class "n" are sorted as numbers, others as text.
    """

    label: str
    show: Callable[[Any], str] = str
    kind: str = "text"

    @classmethod
    def number(cls, label: str, digits: int = 3) -> Column:
        """A column of numbers, shown to `digits` significant digits; the CSV has all digits."""
        return cls(label, lambda value: format_number(value, digits), "n")

    @classmethod
    def count(cls, label: str) -> Column:
        """A column of whole numbers."""
        return cls(label, lambda value: f"{value:,.0f}", "n")


@dataclass(frozen=True)
class Table:
    """A table.

    name: of its CSV file, without ".csv". rows: a value for each column; None for an empty cell. title: the
    line above the table; a click on it folds or unfolds the table.
    """

    name: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Any]] = field(repr=False)
    title: str = "Table of the values"

    @property
    def cells(self) -> list[list[tuple[str, str, str]]]:
        """For each row, (kind of the column, whole value as text, shown text) of each cell."""
        return [
            [
                (c.kind, "" if v is None else str(v), "–" if v is None else c.show(v))
                for c, v in zip(self.columns, row, strict=True)
            ]
            for row in self.rows
        ]
