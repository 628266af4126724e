"""Changes the frame rate: positions by linear interpolation, rotations by spherical interpolation."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array


def sample_times(frames: int, source_fps: float, fps: float) -> Array:
    """(N,) times of the new frames, counted in source frames, from 0 to the last that is within the clip.

    frames: number of source frames.

    >>> sample_times(5, 120, 60)
    array([0., 2., 4.])
    """
    last = int(np.floor((frames - 1) * fps / source_fps + 1e-6))
    return np.minimum(np.arange(last + 1) * (source_fps / fps), frames - 1)


def _neighbours(times: Array) -> tuple[Array, Array, Array]:
    """For each of the `times` (N,): the frame before it, the frame after it, and its position between them.

    The position is 0 to 1, and 0 at a whole frame. There both frames are this frame.
    """
    first = np.floor(times + 1e-9).astype(int)
    share = np.clip(times - first, 0.0, 1.0)
    share[share < 1e-9] = 0.0
    return first, np.where(share > 0, first + 1, first), share


def sample_rotations(rotations: Array, times: Array) -> Array:
    """Rotations (N, J, 4) at `times` (N,), interpolated between the rotations (F, J, 4) of F frames.

    times: in frames. At a whole frame the result is exactly the rotations of that frame.
    """
    first, second, share = _neighbours(times)
    if not share.any():
        return quat.continuous(rotations[first])
    out = quat.slerp(rotations[first], rotations[second], share[:, None])
    out[share == 0] = rotations[first[share == 0]]
    return quat.continuous(quat.normalize(out))


def sample_positions(positions: Array, times: Array) -> Array:
    """Positions (N, ..., 3) at `times` (N,), interpolated between the positions (F, ..., 3) of F frames.

    times: in frames.
    """
    first, second, share = _neighbours(times)
    share = share.reshape(-1, *(1,) * (positions.ndim - 1))  # (N, 1, ..., 1), to broadcast
    return positions[first] * (1 - share) + positions[second] * share
