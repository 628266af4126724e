"""Types of numbers on disk: float32, or float16 or bfloat16 with half the bytes.

float16 has 11 significant bits and a largest value of 65,504; bfloat16 has 8 significant bits
and the range of float32. NumPy has no bfloat16, so a bfloat16 is the upper 16 bits of a float32, in uint16.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.errors import HobbleError
from hobble.core.quat import Array

STORED: dict[str, np.dtype[Any]] = {
    "float32": np.dtype("<f4"),
    "float16": np.dtype("<f2"),
    "bfloat16": np.dtype("<u2"),
}


def narrow(values: Array, precision: str) -> np.ndarray:
    """The values in the type that is stored for `precision` (STORED), rounded to nearest even.

    Raises HobbleError if a value is too large for float16.
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
    bits = np.asarray(values, "<f4").view("<u4")
    return ((bits + np.uint32(0x7FFF) + ((bits >> 16) & 1)) >> 16).astype("<u2")


def widen(values: np.ndarray) -> Array:
    """Convert stored bfloat16 to float32. Other types are returned unchanged."""
    if values.dtype != STORED["bfloat16"]:
        return values
    return (values.astype("<u4") << 16).view("<f4")
