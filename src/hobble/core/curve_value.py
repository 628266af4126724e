"""The value of a curve between its frames."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array


def value_at(curve: Array, when: Array | float) -> Array:
    """Linear interpolation of a curve (F,) at times in frames: `np.interp(when, np.arange(F), curve)`.

    np.interp reads the whole curve at every call. If it were called for each step of a long clip, the time
    would grow with the square of the clip's length. This function reads only the frames around `when`.

    >>> float(value_at(np.array([0.0, 10.0, 40.0]), 1.5))
    25.0
    """
    times = np.asarray(when, float)
    if not times.size:
        return np.zeros(times.shape)
    last = len(curve) - 1
    first = min(max(int(times.min()), 0), last)
    part = curve[first : min(max(int(times.max()), 0), last) + 2]
    return np.asarray(np.interp(times, np.arange(first, first + len(part)), part))
