"""The compiled loop with which `hobble.motion.read_numbers` reads the table of numbers in a BVH file."""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.compiled import njit

EXACT = np.uint64(1 << 53)  # a double holds every integer up to this one exactly
MOST_POWER = 22  # a double holds every power of ten up to this one exactly
POWERS = np.array([float(f"1e{power}") for power in range(MOST_POWER + 1)])
MOST_DIGITS = 18  # every integer with this many digits fits into 64 bits
LARGEST_EXPONENT = 400  # no double has a larger exponent; numbers with a larger one are left to Python
NUMBER, END_OF_LINE, END, OTHER = range(4)  # what can follow blanks
TEN = np.uint64(10)
# ASCII codes.
ZERO = np.uint8(48)
PLUS, MINUS, POINT, SMALL_E, LARGE_E = 43, 45, 46, 101, 69
TAB, LINE_FEED, RETURN, SPACE = 9, 10, 13, 32


@njit(error_model="numpy")
def read_lines(data: Any, at: int, table: Any, long: Any) -> tuple[int, int]:
    """Read the lines of data (n,), the bytes of a file, from `at` on into table (F, width).

    Returns the number of lines, or -1 if something is unusual (as `read_numbers` lists it), and how many
    numbers are too long to be read here. For each of the long numbers, its index in the flat table and its
    begin and end in data are written to long (m, 3).
    """
    rows, width = table.shape
    row, column, long_count = 0, 0, 0
    while True:
        at, met = _to_next(data, at)
        if met == OTHER:
            return -1, long_count
        if met != NUMBER:
            if column != 0:
                if column != width:
                    return -1, long_count
                row, column = row + 1, 0
            if met == END:
                return row, long_count
            continue
        if row == rows or column == width:
            return -1, long_count
        value, end, exact = _number(data, at)
        if end < 0:
            return -1, long_count
        table[row, column] = value
        if not exact:
            if long_count == len(long):
                return -1, long_count
            long[long_count, 0], long[long_count, 1], long[long_count, 2] = row * width + column, at, end
            long_count += 1
        at, column = end, column + 1


@njit(inline="always")
def _to_next(data: Any, at: int) -> tuple[int, int]:
    """Skip blanks. Returns the next place, and what is there: NUMBER, END_OF_LINE, END (of data) or OTHER.

    For an END_OF_LINE, the place is the start of the next line.
    """
    size = len(data)
    while at < size and (data[at] == SPACE or data[at] == TAB):
        at += 1
    if at == size:
        return at, END
    if data[at] == LINE_FEED:
        return at + 1, END_OF_LINE
    if data[at] == RETURN:
        if at + 1 < size and data[at + 1] == LINE_FEED:
            return at + 2, END_OF_LINE
        return at, OTHER
    return at, NUMBER


@njit(inline="always")
def _number(data: Any, at: int) -> tuple[float, int, bool]:
    """The number at `at`, where it ends (-1 if there is no number), and whether it is exact."""
    size = len(data)
    negative = data[at] == MINUS
    if negative or data[at] == PLUS:
        at += 1
    whole, power, begin = np.uint64(0), 0, at
    while at < size and np.uint8(data[at] - ZERO) <= 9:  # letters before "0" wrap around to more than 9
        whole = whole * TEN + np.uint64(np.uint8(data[at] - ZERO))
        at += 1
    digits = at - begin
    if at < size and data[at] == POINT:
        at += 1
        begin = at
        while at < size and np.uint8(data[at] - ZERO) <= 9:
            whole = whole * TEN + np.uint64(np.uint8(data[at] - ZERO))
            at += 1
        power = begin - at
        digits -= power
    if digits == 0:
        return 0.0, -1, False
    if at < size and (data[at] == SMALL_E or data[at] == LARGE_E):
        shift, at = _exponent(data, at + 1)
        if at < 0:
            return 0.0, -1, False
        power += shift
    if at < size and not (data[at] == SPACE or TAB <= data[at] <= RETURN):
        return 0.0, -1, False
    exact: Any = digits <= MOST_DIGITS and whole <= EXACT and -MOST_POWER <= power <= MOST_POWER
    value = 0.0
    if exact:
        integer = np.float64(whole)
        value = integer / POWERS[-power] if power < 0 else integer * POWERS[power]
    return (-value if negative else value), at, exact


@njit(inline="always")
def _exponent(data: Any, at: int) -> tuple[int, int]:
    """The exponent at `at`, and where it ends (-1 if there is no digit).

    Above LARGEST_EXPONENT, the number returned may be too small, but not below that limit.
    """
    size = len(data)
    negative = at < size and data[at] == MINUS
    if at < size and (negative or data[at] == PLUS):
        at += 1
    shift: Any = np.int64(0)
    begin = at
    while at < size and np.uint8(data[at] - ZERO) <= 9:
        if shift < LARGEST_EXPONENT:
            shift = 10 * shift + np.int64(np.uint8(data[at] - ZERO))
        at += 1
    return (-shift if negative else shift), (at if at > begin else -1)
