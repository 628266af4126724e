"""Reads the table of numbers in a BVH file with compiled code, for `hobble.motion.read_numbers`.

A number is read as an integer times or divided by a power of ten. If a double holds both exactly, one
multiplication or division gives the same result as Python's `float`. Any other number is left to `float`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.compiled import njit

EXACT = np.uint64(1 << 53)  # a double holds every integer up to this one exactly
MOST_POWER = 22  # a double holds 10 to this power, and to every smaller one, exactly
POWERS = np.array([float(f"1e{power}") for power in range(MOST_POWER + 1)])
MOST_DIGITS = 18  # every integer with this many digits fits into 64 bits
# No double has such a large power of ten. Once an exponent has reached this, its further digits are skipped,
# so that it does not overflow.
LARGEST_EXPONENT = 400
NUMBER, END_OF_LINE, END_OF_DATA, OTHER = range(4)  # what can follow blanks
TEN = np.uint64(10)
# ASCII codes.
ZERO = np.uint8(48)
PLUS, MINUS, POINT, SMALL_E, LARGE_E = 43, 45, 46, 101, 69
TAB, LINE_FEED, RETURN, SPACE = 9, 10, 13, 32


@njit(error_model="numpy")
def read_lines(data: Any, at: int, table: Any, long_numbers: Any) -> tuple[int, int]:
    """Read lines of numbers from a file into a table.

    data: (n,) uint8, the bytes of the file. at: index of the byte at which to begin. table: (F, width) float;
    the numbers are written to it, a line to each row. long_numbers: (M, 3) int. For each number that must be
    left to `float`, three values are written to it: the number's index in the flattened table, and the
    indices in data of its first byte and of the byte after its last.

    Returns how many lines were read and how many numbers must be left to `float`. The first value is -1 if
    the text is unusual: if a line has not `width` numbers, if there is anything but numbers and blanks, or if
    there are more lines or long numbers than the arrays can hold.
    """
    rows, width = table.shape
    row, column, long_count = 0, 0, 0
    while True:
        at, found = _skip_blanks(data, at)
        if found == OTHER:
            return -1, long_count
        if found != NUMBER:
            if column != 0:
                if column != width:
                    return -1, long_count
                row, column = row + 1, 0
            if found == END_OF_DATA:
                return row, long_count
            continue
        if row == rows or column == width:
            return -1, long_count
        value, end, exact = _read_number(data, at)
        if end < 0:
            return -1, long_count
        table[row, column] = value
        if not exact:
            if long_count == len(long_numbers):
                return -1, long_count
            long_numbers[long_count, 0] = row * width + column
            long_numbers[long_count, 1], long_numbers[long_count, 2] = at, end
            long_count += 1
        at, column = end, column + 1


@njit(inline="always")
def _skip_blanks(data: Any, at: int) -> tuple[int, int]:
    """Skip spaces and tabs from index `at` on, and an end of line after them.

    Returns the index of the byte after the skipped ones, and what was found: NUMBER (any byte that is not
    checked yet), END_OF_LINE, END_OF_DATA, or OTHER for a carriage return without a line feed.
    """
    size = len(data)
    while at < size and (data[at] == SPACE or data[at] == TAB):
        at += 1
    if at == size:
        return at, END_OF_DATA
    if data[at] == LINE_FEED:
        return at + 1, END_OF_LINE
    if data[at] == RETURN:
        if at + 1 < size and data[at + 1] == LINE_FEED:
            return at + 2, END_OF_LINE
        return at, OTHER
    return at, NUMBER


@njit(inline="always")
def _read_number(data: Any, at: int) -> tuple[float, int, bool]:
    """Read the number that begins at index `at`.

    Returns its value, the index after its last byte (-1 if there is no number), and whether the value is
    exactly the one of Python's `float`. If not, the value is 0.
    """
    size = len(data)
    negative = data[at] == MINUS
    if negative or data[at] == PLUS:
        at += 1
    # The number is whole * 10 ** power. `whole` gets all its digits, also those after the point.
    whole, power, begin = np.uint64(0), 0, at
    while at < size and np.uint8(data[at] - ZERO) <= 9:  # characters below "0" wrap around to more than 9
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
        shift, at = _read_exponent(data, at + 1)
        if at < 0:
            return 0.0, -1, False
        power += shift
    # Only a blank or an end of line may follow.
    if at < size and not (data[at] == SPACE or TAB <= data[at] <= RETURN):
        return 0.0, -1, False
    exact: Any = digits <= MOST_DIGITS and whole <= EXACT and -MOST_POWER <= power <= MOST_POWER
    value = 0.0
    if exact:
        integer = np.float64(whole)
        value = integer / POWERS[-power] if power < 0 else integer * POWERS[power]
    return (-value if negative else value), at, exact


@njit(inline="always")
def _read_exponent(data: Any, at: int) -> tuple[int, int]:
    """Read the exponent that begins at index `at`: the digits after "e", with or without a sign.

    Returns the exponent and the index after its last byte (-1 if there is no digit). The size of an exponent
    above LARGEST_EXPONENT may come out too small, but never below LARGEST_EXPONENT.
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
