"""Samples arrays over frames at fractional frames."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array


def at_frames(values: Array, when: Array) -> Array:
    """(N, ...): values (F, ...) interpolated at the frames `when` (N,)."""
    before, share = _between(len(values), when)
    share = share.reshape(-1, *[1] * (values.ndim - 1))
    return values[before] * (1 - share) + values[np.minimum(before + 1, len(values) - 1)] * share


def turns_at(rotations: Array, when: Array) -> Array:
    """(N, ..., 4): rotations (F, ..., 4) interpolated at the frames `when` (N,)."""
    before, share = _between(len(rotations), when)
    share = share.reshape(-1, *[1] * (rotations.ndim - 2))
    return quat.slerp(rotations[before], rotations[np.minimum(before + 1, len(rotations) - 1)], share)


def _between(frames: int, when: Array) -> tuple[np.ndarray, Array]:
    when = np.clip(when, 0.0, frames - 1.0)
    nearest = np.round(when)
    when = np.where(np.abs(when - nearest) < 1e-9, nearest, when)
    before = np.floor(when).astype(int)
    return before, when - before


def smoothstep(u: Array) -> Array:
    """A curve that rises from 0 at u = 0 to 1 at u = 1, with zero slope at both ends."""
    u = np.clip(u, 0.0, 1.0)
    return u * u * (3 - 2 * u)
