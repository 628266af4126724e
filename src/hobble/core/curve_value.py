"""The value of a curve between its frames."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array


def interpolate_curve(curve: Array, when: Array | float) -> Array:
    """The values of a curve (F,) at the times `when`, interpolated linearly. They have the shape of `when`.

    when: times in frames. Before frame 0 and after the last frame the curve is constant. The result is that
    of `np.interp(when, np.arange(F), curve)`. np.interp reads the whole curve at every call, which is slow
    for many calls with a long curve. This function reads only the frames around `when`.

    >>> float(interpolate_curve(np.array([0.0, 10.0, 40.0]), 1.5))
    25.0
    """
    times = np.asarray(when, float)
    if not times.size:
        return np.zeros(times.shape)
    last = len(curve) - 1
    first = min(max(int(times.min()), 0), last)
    near = curve[first : min(max(int(times.max()), 0), last) + 2]
    return np.asarray(np.interp(times, np.arange(first, first + len(near)), near))
