"""Standing feet of another shape: tilted so little that nobody sees it, so that their heels do not slide."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array

STANDING = 0.8  # cm a frame at 60 Hz: a heel slower than this is treated as standing
SHORTEST = 1 / 20  # seconds
RAMP = 1 / 15  # seconds over which the tilt sets in
MOST_TILT = np.radians(6.0)
LOW = 2.5  # cm of height of the ankle above the ball from which on tilting helps


def level_heels(foot: Array, heel: Array, toe: Array, fps: float) -> Array:
    """Rotations (F, 4) about the ball of the foot that keep a standing heel as still as the source's.

    A foot of another shape carries its ankle at another height above the ball, so that the same rocking would
    move it further over the ground. foot: (F, 3) from heel to ball in the world, of the figure to be kept
    from sliding. heel, toe: (F, 3) where the source has them, scaled.
    """
    apart = toe - foot - heel
    missing = np.zeros_like(foot)
    for first, last in standing_runs(heel, STANDING * 60.0 / fps, round(fps * SHORTEST)):
        here = slice(first, last)
        share = _eased(last - first, round(fps * RAMP), first == 0, last == len(heel))
        missing[here] = (apart[here] - apart[here].mean(axis=0)) * share[:, None]
    level = foot * [1, 0, 1]
    across = np.linalg.norm(level, axis=1, keepdims=True)
    ahead = level / np.maximum(across, 1e-9)
    side = np.cross([0.0, 1.0, 0.0], ahead)
    # Raising the heel by an angle moves it level by that times its height; where it has none, nothing helps.
    height = foot[:, 1]
    pitch = np.sum(missing * ahead, axis=1) * height / (height**2 + LOW**2)
    yaw = np.sum(missing * side, axis=1) / np.maximum(across[:, 0], LOW)
    tilt = quat.from_axis_angle(side, MOST_TILT * np.tanh(pitch / MOST_TILT))
    return quat.mul(quat.yaw(MOST_TILT * np.tanh(yaw / MOST_TILT)), tilt)


def standing_runs(point: Array, slow: float, shortest: int) -> list[tuple[int, int]]:
    """Runs [first, last) of `shortest` frames or more in which a point (F, 3) moves less than `slow` each."""
    speed = np.linalg.norm(np.diff(point, axis=0), axis=1)
    still = np.concatenate([[False], speed < slow, [False]])
    starts = np.flatnonzero(~still[:-1] & still[1:])
    ends = np.flatnonzero(still[:-1] & ~still[1:]) + 1
    return [(int(a), int(b)) for a, b in zip(starts, ends, strict=True) if b - a >= shortest]


def _eased(frames: int, ramp: int, open_start: bool, open_end: bool) -> Array:
    """(frames,) weights that rise from 0 to 1 and fall again over `ramp` frames, but not at an open end."""
    n = np.arange(frames)
    up = np.ones(frames) if open_start else np.clip((n + 1) / (ramp + 1), 0, 1)
    down = np.ones(frames) if open_end else np.clip((frames - n) / (ramp + 1), 0, 1)
    share = np.minimum(up, down)
    return share * share * (3 - 2 * share)
