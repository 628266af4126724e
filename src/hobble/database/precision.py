"""Types of numbers on disk: float32, or one of two types with half the bytes, float16 and bfloat16.

float16 has 11 significant bits and a largest value of 65,504. bfloat16 has 8 significant bits and the range
of float32: its bits are the upper 16 bits of a float32. NumPy has no bfloat16. So these bits are held as a
uint16 number.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.errors import HobbleError
from hobble.core.quat import Array

# Name of a precision -> NumPy's type of the stored numbers.
STORED: dict[str, np.dtype[Any]] = {
    "float32": np.dtype("<f4"),
    "float16": np.dtype("<f2"),
    "bfloat16": np.dtype("<u2"),
}


def to_stored_type(values: Array, precision: str) -> np.ndarray:
    """Convert float values to the type that is stored for `precision`, a key of STORED.

    Rounds to the nearest number, and a value halfway between two numbers to the one whose last bit is 0.
    Raises HobbleError if a value is too large for the type.
    """
    if precision != "bfloat16":
        with np.errstate(over="ignore"):
            out = np.asarray(values, STORED[precision])
        if not np.isfinite(out).all():
            largest = float(np.abs(values).max())
            raise HobbleError(
                f"a standardised value of {largest:.3g} does not fit {precision}. "
                "Set database.dtype to bfloat16 or float32."
            )
        return out
    # The lower 16 bits are cut off. To round, add 0x7FFF first, and 1 more if the last bit that stays is 1.
    bits = np.asarray(values, "<f4").view("<u4")
    return ((bits + np.uint32(0x7FFF) + ((bits >> 16) & 1)) >> 16).astype("<u2")


def to_floats(values: np.ndarray) -> Array:
    """Convert stored bfloat16 (uint16) to float32. Other types are returned unchanged."""
    if values.dtype != STORED["bfloat16"]:
        return values
    return (values.astype("<u4") << 16).view("<f4")
