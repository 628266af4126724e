"""The history of a training: writes history.csv, with one row per section. Also durations as text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from hobble.core.files import write_text

# The columns of history.csv before the held-out errors of the blocks of Y; `columns` explains them.
COLUMNS = ("pass", "section", "samples", "seconds", "train_mse", "held_out_mse")


def columns(blocks: Iterable[str]) -> list[str]:
    """The names of all columns of history.csv. blocks: names of the blocks of Y.

    Samples and seconds are totals from the start; passes and sections begin at 1. train_mse is the mean over
    the section's batches, with dropout. The held-out errors are measured at the end of the section, without
    dropout. All errors are mean squared errors of the standardised output.
    """
    return [*COLUMNS, *(f"held_out_{name}" for name in blocks)]


def write_history(path: Path, blocks: Iterable[str], rows: Sequence[Sequence[float]]) -> None:
    """Write history.csv. blocks: names of the blocks of Y. rows: the values of `columns` for each section.

    A value that is nan (a held-out error without held-out clips) is left empty.
    """
    lines = [",".join(columns(blocks))]
    lines += [",".join(_cell(i, value) for i, value in enumerate(row)) for row in rows]
    write_text(path, "\n".join(lines) + "\n")


def _cell(column: int, value: float) -> str:
    """A value as text: counts in columns 0 to 2, seconds in column 3, then errors."""
    if value != value:  # nan
        return ""
    return str(round(value)) if column < 3 else f"{value:.3f}" if column == 3 else f"{value:.8g}"


def duration(seconds: float) -> str:
    """A duration as text.

    >>> duration(42.4), duration(754), duration(7512)
    ('42 s', '12 min 34 s', '2 h 05 min')
    """
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60:02d} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60:02d} min"
