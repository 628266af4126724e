"""Reads the table of numbers of a large BVH file with compiled code. The results equal those of `float`.

A decimal number is an integer times or divided by a power of ten. If a double can hold both the integer and
the power exactly, one multiplication or division rounds like `float` (Clinger, How to read floating point
numbers accurately, 1990). Longer numbers are read by `float` itself. A file that is unusual in another way is
left to the general reader (in `hobble.motion.read`).
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from hobble.core.quat import Array

LARGE = 1 << 25  # bytes; for a smaller file, loading the compiler takes longer than it saves
# Share of numbers that are too long for the compiled code and are read by `float`. If it is larger than this,
# the general reader takes no longer.
MOST_LONG = 0.25


def read_numbers(data: bytes, at: int, width: int, declared: int) -> Array | None:
    """The table (F, width) of the numbers in `data` from byte `at` on.

    None if the general reader is needed. It is needed if the text is shorter than LARGE and the compiler is
    not loaded yet; if a line does not have `width` values; if there are more than `declared` + 1 lines; if
    there is anything but decimal numbers, blanks and line ends; or if more than MOST_LONG of the numbers are
    too long for the compiled code. declared: the number of frames that the file declares.
    """
    if len(data) - at < LARGE and "numba" not in sys.modules:
        return None
    table = np.empty((declared + 1, width))
    # For each number that is too long: its index in the flat table, and its begin and end in `data`.
    long = np.empty((int(MOST_LONG * table.size) + 1, 3), np.int64)
    lines, long_count = _compiled()(np.frombuffer(data, np.uint8), at, table, long)
    if lines < 0:  # something is unusual
        return None
    values = table.reshape(-1)
    for index, begin, end in long[:long_count].tolist():
        values[index] = float(data[begin:end])
    return table[:lines]


def _compiled() -> Any:
    """The compiled function. It is imported late, because loading the compiler takes .1 to .3 s."""
    from hobble.motion.number_loop import read_lines

    return read_lines
