"""Reads the table of numbers of a large BVH file with compiled code, with the results of Python's `float`.

For most numbers, a double can hold the digits as an integer exactly, and the power of ten, too. Then one
multiplication or division rounds like `float` (Clinger, How to read floating point numbers accurately, 1990).
Python reads longer numbers. A file with anything else that is unusual is left to the general reader.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from hobble.core.quat import Array

LARGE = 1 << 25  # bytes; for a smaller file, loading the compiler takes longer than it saves
# Largest share of the numbers that Python may read; with more, the general reader is as fast.
MOST_LONG = 0.25


def read_numbers(data: bytes, at: int, width: int, declared: int) -> Array | None:
    """The table (F, width) of the lines from `at` on, or None if the general reader has to read it.

    It has to if any of these is true: the text is shorter than LARGE and the compiler is not loaded yet; a
    line does not have `width` values; there are more than `declared` + 1 lines; there is anything but decimal
    numbers, blanks and line ends; more than MOST_LONG of the numbers are too long to be read here.
    """
    if len(data) - at < LARGE and "numba" not in sys.modules:
        return None
    table = np.empty((declared + 1, width))
    long = np.empty((int(MOST_LONG * table.size) + 1, 3), np.int64)
    lines, found = _compiled()(np.frombuffer(data, np.uint8), at, table, long)
    if lines < 0:
        return None
    values = table.reshape(-1)
    for place, begin, end in long[:found].tolist():
        values[place] = float(data[begin:end])
    return table[:lines]


def _compiled() -> Any:
    """The compiled loop. Imported here because loading the compiler takes .1 to .3 s."""
    from hobble.motion.number_loop import read_lines

    return read_lines
