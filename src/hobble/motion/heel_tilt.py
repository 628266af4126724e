"""Keeps the heels of standing feet from sliding, by tilting each foot about its ball."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array

STANDING = 0.8  # cm a frame at 60 Hz: a slower heel counts as standing
SHORTEST = 1 / 20  # seconds; a heel that is slow for a shorter time does not stand
RAMP = 1 / 15  # seconds before and after standing over which the tilt is blended
MOST_TILT = np.radians(
    10.5
)  # limit of the tilt; half of all frames need at most 0.3 degrees, nine of ten at most 3.5
LOW = 1.5  # cm: if the ankle is less than this above the ball, tilting has little effect and is reduced


def level_heels(foot: Array, heel: Array, toe: Array, fps: float) -> Array:
    """Rotations (F, 4) about the ball of the foot that keep a standing heel as still as in the source.

    They are needed because the target's ankle may be higher above the ball than the source's, so that the
    same rotation moves it farther over the ground. foot: (F, 3) cm from heel to ball in the world, on the
    target. heel, toe: (F, 3) cm, positions of heel and ball on the source, scaled to the target.
    """
    apart = toe - foot - heel
    missing = np.zeros_like(foot)
    runs = standing_runs(heel, STANDING * 60.0 / fps, round(fps * SHORTEST))
    for first, last in runs:
        missing[first:last] = apart[first:last] - np.median(apart[first:last], axis=0)
    missing = _bridged(missing, runs, round(fps * RAMP))
    level = foot * [1, 0, 1]
    across = np.linalg.norm(level, axis=1, keepdims=True)
    ahead = level / np.maximum(across, 1e-9)
    side = np.cross([0.0, 1.0, 0.0], ahead)
    # A pitch moves the heel over the ground by the angle times the heel's height above the ball. Without
    # height it has no effect.
    height = foot[:, 1]
    pitch = np.sum(missing * ahead, axis=1) * height**3 / (height**4 + LOW**4)
    yaw = np.sum(missing * side, axis=1) / np.maximum(across[:, 0], LOW)
    tilt = quat.from_axis_angle(side, _limited(pitch))
    return quat.mul(quat.yaw(_limited(yaw)), tilt)


def _limited(angle: Array) -> Array:
    """The angle, limited smoothly to MOST_TILT. Small angles do not change."""
    return angle / (1 + (angle / MOST_TILT) ** 6) ** (1 / 6)


def standing_runs(point: Array, slow: float, shortest: int) -> list[tuple[int, int]]:
    """(first, stop) of each run of `shortest` frames or more in which a point (F, 3) is slower than `slow`.

    slow: cm a frame.
    """
    speed = np.linalg.norm(np.diff(point, axis=0), axis=1)
    still = np.concatenate([[False], speed < slow, [False]])
    starts = np.flatnonzero(~still[:-1] & still[1:])
    ends = np.flatnonzero(still[:-1] & ~still[1:]) + 1
    return [(int(a), int(b)) for a, b in zip(starts, ends, strict=True) if b - a >= shortest]


def _bridged(values: Array, runs: list[tuple[int, int]], ramp: int) -> Array:
    """(F, 3) numbers that equal `values` within the runs and are smooth between them.

    They fade out over `ramp` frames after a run and fade in over `ramp` frames before the next. Between runs
    that are less than two ramps apart, they change smoothly from the value of one run to that of the next.
    """
    at: list[int] = [-ramp - 1]
    fixed: list[Array] = [np.zeros((1, 3))]
    for first, last in runs:
        if first - at[-1] > 2 * ramp:
            at += [at[-1] + ramp, first - ramp]
            fixed.append(np.zeros((2, 3)))
        at += range(first, last)
        fixed.append(values[first:last])
    at += [at[-1] + ramp, max(len(values), at[-1] + ramp) + 1]
    fixed.append(np.zeros((2, 3)))
    when, value, frame = np.array(at), np.concatenate(fixed), np.arange(len(values))
    after = np.searchsorted(when, frame, side="right")
    share = (frame - when[after - 1]) / (when[after] - when[after - 1])
    share = (share * share * (3 - 2 * share))[:, None]
    return value[after - 1] * (1 - share) + value[after] * share
