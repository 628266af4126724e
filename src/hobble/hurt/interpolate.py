"""Interpolates arrays that have a value for each frame, at times between frames. Also an easing curve."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array


def interpolate_values(values: Array, when: Array) -> Array:
    """Interpolate values (F, ...) linearly at the times `when` (N,), in frames. Returns (N, ...)."""
    before, share = _split_times(len(values), when)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return values[before] * (1 - share) + values[np.minimum(before + 1, len(values) - 1)] * share


def interpolate_rotations(rotations: Array, when: Array) -> Array:
    """Interpolate quaternions (F, ..., 4) at the times `when` (N,), in frames. Returns (N, ..., 4)."""
    before, share = _split_times(len(rotations), when)
    share = share.reshape(-1, *[1] * (rotations.ndim - 2))
    return quat.slerp(rotations[before], rotations[np.minimum(before + 1, len(rotations) - 1)], share)


def _split_times(frames: int, when: Array) -> tuple[np.ndarray, Array]:
    """Split each time (N,) into the frame before it, int (N,), and the share of a frame after that, (N,).

    Times outside the clip of `frames` frames are moved to its first or last frame.
    """
    when = np.clip(when, 0.0, frames - 1.0)
    # A time that misses a whole frame only by a rounding error counts as this frame.
    nearest = np.round(when)
    when = np.where(np.abs(when - nearest) < 1e-9, nearest, when)
    before = np.floor(when).astype(int)
    return before, when - before


def smoothstep(u: Array) -> Array:
    """A curve that rises from 0 at u = 0 to 1 at u = 1, with zero slope at both ends."""
    u = np.clip(u, 0.0, 1.0)
    return u * u * (3 - 2 * u)
