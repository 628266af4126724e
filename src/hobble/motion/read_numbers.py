"""Reads the table of numbers of a large BVH file with compiled code, with the results of Python's `float`.

Most numbers are an integer times or divided by a power of ten. If a double can hold both the integer and the
power exactly, one multiplication or division rounds like `float` (Clinger, How to read floating point numbers
accurately, 1990). Longer numbers are read by `float` itself. A file with anything else unusual is left to the
general reader (in `hobble.motion.read`).
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from hobble.core.quat import Array

LARGE = 1 << 25  # bytes; for a smaller file, loading the compiler takes longer than it saves
# Largest share of numbers too long for the compiled code. If Python has to read more of them, the general
# reader is as fast.
MOST_LONG = 0.25


def read_numbers(data: bytes, at: int, width: int, declared: int) -> Array | None:
    """The table (F, width) of the numbers in `data` from byte `at` on, or None for the general reader.

    declared: the number of frames that the file declares. None is returned if the text is shorter than LARGE
    and the compiler is not loaded yet; if a line does not have `width` values; if there are more than
    `declared` + 1 lines; if there is anything but decimal numbers, blanks and line ends; or if more than
    MOST_LONG of the numbers are too long for the compiled code.
    """
    if len(data) - at < LARGE and "numba" not in sys.modules:
        return None
    table = np.empty((declared + 1, width))
    long = np.empty((int(MOST_LONG * table.size) + 1, 3), np.int64)
    lines, long_numbers = _compiled()(np.frombuffer(data, np.uint8), at, table, long)
    if lines < 0:
        return None
    values = table.reshape(-1)
    for place, begin, end in long[:long_numbers].tolist():
        values[place] = float(data[begin:end])
    return table[:lines]


def _compiled() -> Any:
    """The compiled loop. It is imported only when needed, because loading the compiler takes .1 to .3 s."""
    from hobble.motion.number_loop import read_lines

    return read_lines
