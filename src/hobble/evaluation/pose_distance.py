"""The distance between the poses of two walks at the same phase, and the time until a motion settles."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array

PHASES = 24  # phase bins of a cycle
FPS = 60
# A distance has settled when it differs from its last value by at most this share of its whole change.
SETTLED_SHARE = 0.1
SMALLEST_CHANGE_CM = 0.1  # smaller changes get no settling time


def phase_bins(phase: Array) -> np.ndarray:
    """(...) index of the bin of each phase, 0 to PHASES - 1. phase: (...) from 0 to 1."""
    return np.minimum((np.asarray(phase) * PHASES).astype(int), PHASES - 1)


def mean_cycle(local: Array, phase: Array) -> Array:
    """(PHASES, J, 3) mean pose in each phase bin. local: (F, J, 3) joint positions, cm. phase: (F,).

    An empty bin gets the pose of the nearest bin that is not empty.
    """
    bin_of_frame = phase_bins(phase)
    mean = np.zeros((PHASES, *local.shape[1:]))
    filled = np.unique(bin_of_frame)
    for b in filled:
        mean[b] = local[bin_of_frame == b].mean(axis=0)
    for b in set(range(PHASES)) - set(filled.tolist()):
        gap = np.abs(filled - b)
        nearest = np.argmin(np.minimum(gap, PHASES - gap))  # the last bin is next to the first
        mean[b] = mean[filled[nearest]]
    return mean


def distance_to_cycle(local: Array, phase: Array, cycle: Array) -> Array:
    """(F,) distance of each pose from the pose of a mean cycle at the same phase, cm, mean over the joints.

    local: (F, J, 3) joint positions, cm. phase: (F,). cycle: result of `mean_cycle`.
    """
    return np.linalg.norm(local - cycle[phase_bins(phase)], axis=-1).mean(axis=-1)


def cycle_frames(phase: Array) -> int:
    """Mean length of a cycle in frames, limited to the range from 10 to 90. phase: (F,)."""
    rate = np.mod(np.diff(phase), 1.0).mean()
    return int(np.clip(round(1 / max(rate, 1e-3)), 10, 3 * FPS // 2))


def settling_seconds(distance: Array, normal: float, window: int) -> float | None:
    """Seconds from a change until a motion has settled.

    The motion has settled when `distance` is close to its last value and stays so.

    distance: (F,) distance to a reference motion in each frame after the change, cm. normal: the distance
    before the change, cm. window: number of frames over which `distance` is averaged, usually a cycle.
    "Close" means within SETTLED_SHARE of the difference between `normal` and the last value. None if this
    difference is below SMALLEST_CHANGE_CM.
    """
    window = min(window, len(distance))
    smooth = np.convolve(distance, np.ones(window) / window, mode="valid")
    change = abs(float(smooth[-1]) - normal)
    if change < SMALLEST_CHANGE_CM:
        return None
    unsettled = np.abs(smooth - smooth[-1]) > SETTLED_SHARE * change
    return round((int(np.flatnonzero(unsettled)[-1]) + window if np.any(unsettled) else 0) / FPS, 5)
