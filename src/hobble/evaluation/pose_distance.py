"""The distance between the poses of two walks at the same phase, and how soon a motion settles."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array

PHASES = 24  # phase bins of a cycle
FPS = 60
# A value has settled when it differs from its last value by at most this share of the whole change.
SETTLED_SHARE = 0.1
SMALLEST_CHANGE_CM = 0.1  # smaller changes get no settling time


def phase_bins(phase: Array) -> np.ndarray:
    """(...) index of the bin of each phase, 0 to PHASES - 1."""
    return np.minimum((np.asarray(phase) * PHASES).astype(int), PHASES - 1)


def mean_cycle(local: Array, phase: Array) -> Array:
    """(PHASES, J, 3) mean pose in each phase bin. local: (F, J, 3) joint positions, cm. phase: (F,).

    An empty bin gets the pose of the nearest bin that is not empty.
    """
    at = phase_bins(phase)
    mean = np.zeros((PHASES, *local.shape[1:]))
    seen = np.unique(at)
    for b in seen:
        mean[b] = local[at == b].mean(axis=0)
    for b in set(range(PHASES)) - set(seen.tolist()):
        gap = np.abs(seen - b)
        mean[b] = mean[seen[np.argmin(np.minimum(gap, PHASES - gap))]]
    return mean


def distance_to_cycle(local: Array, phase: Array, cycle: Array) -> Array:
    """(F,) mean distance of the joints of local (F, J, 3) from a mean cycle at the same phase, cm."""
    return np.linalg.norm(local - cycle[phase_bins(phase)], axis=-1).mean(axis=-1)


def period(phase: Array) -> int:
    """Mean length of a cycle in frames, limited to 10 to 90. phase: (F,)."""
    rate = np.mod(np.diff(phase), 1.0).mean()
    return int(np.clip(round(1 / max(rate, 1e-3)), 10, 3 * FPS // 2))


def settling(distance: Array, normal: float, window: int) -> float | None:
    """Seconds until a motion has settled after a change: until `distance` stays close to its last value.

    distance: (F,) cm to a reference motion, in each frame after the change. normal: the distance before the
    change, cm. window: frames to average over, usually a cycle. Close means within SETTLED_SHARE of the
    difference between `normal` and the last value. None if this difference is below SMALLEST_CHANGE_CM.
    """
    window = min(window, len(distance))
    smooth = np.convolve(distance, np.ones(window) / window, mode="valid")
    change = abs(float(smooth[-1]) - normal)
    if change < SMALLEST_CHANGE_CM:
        return None
    out = np.abs(smooth - smooth[-1]) > SETTLED_SHARE * change
    return round((int(np.flatnonzero(out)[-1]) + window if np.any(out) else 0) / FPS, 5)
