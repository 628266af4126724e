"""Reads the table of numbers of a large BVH file by compiled code, with the same bits as Python's `float`.

A double holds the digits of most numbers, as an integer, and the power of ten exactly. Then one
multiplication or division rounds as `float` does (Clinger, How to read floating point numbers accurately,
1990). Python reads the longer numbers. Whatever else is unusual is left to the general reader.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from hobble.core.quat import Array

LARGE = 1 << 25  # bytes: below, loading the compiler takes longer than it saves
# At most this share of the numbers is read by Python; with more, the general reader is as fast.
MOST_LONG = 0.25


def read_numbers(data: bytes, at: int, width: int, declared: int) -> Array | None:
    """The table (F, width) of the lines from `at` on, or None if the general reader has to read it.

    It has to if the text is shorter than LARGE, if a line does not have `width` values, if there are over
    `declared` + 1 lines, and if there is anything but decimal numbers, blanks and line ends.
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
