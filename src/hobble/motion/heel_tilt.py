"""Keeps the heels of standing feet from sliding, by turning each foot about its ball."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array

STANDING = 0.8  # cm a frame at 60 Hz: a slower heel counts as standing
SHORTEST = 1 / 20  # seconds; a heel that is slow for a shorter time does not stand
RAMP = 1 / 15  # seconds over which the rotation fades in before a heel stands, and out after it
# Largest angle by which a foot is turned about each axis. Half of all frames need at most 0.3 degrees, nine
# of ten at most 3.5.
MOST_TILT = np.radians(10.5)
# cm. If the ankle is less than this above the ball, tilting hardly moves the heel and is reduced. The
# rotation about the vertical is reduced if the ankle is less than this behind the ball.
LOW = 1.5


def steady_heels(foot: Array, heel: Array, toe: Array, fps: float) -> Array:
    """World rotations (F, 4) of a foot about its ball that keep a standing heel as still as in the source.

    Source and target are the skeletons before and after retargeting. The rotations are needed because the
    target's ankle may be higher above the ball than the source's. Then the same rotation of the foot moves
    the heel further over the ground.

    foot: (F, 3) cm from heel to ball in the world, on the target. heel, toe: (F, 3) cm, positions of heel and
    ball on the source, scaled to the target.
    """
    # From the source's heel to the target's, with both balls at the same place.
    apart = toe - foot - heel
    slide = np.zeros_like(foot)
    runs = standing_runs(heel, STANDING * 60.0 / fps, round(fps * SHORTEST))
    for first, stop in runs:
        slide[first:stop] = apart[first:stop] - np.median(apart[first:stop], axis=0)
    slide = _bridged(slide, runs, round(fps * RAMP))
    level = foot * [1, 0, 1]
    length = np.linalg.norm(level, axis=1, keepdims=True)
    ahead = level / np.maximum(length, 1e-9)
    left = np.cross([0.0, 1.0, 0.0], ahead)
    # A small pitch moves the heel over the ground by the angle times the heel's height above the ball, which
    # is -rise. So the angle that undoes a slide is slide / rise. If the rise is small, a pitch has little
    # effect. The formula then goes to 0 instead of to infinity.
    rise = foot[:, 1]
    pitch = np.sum(slide * ahead, axis=1) * rise**3 / (rise**4 + LOW**4)
    yaw = np.sum(slide * left, axis=1) / np.maximum(length[:, 0], LOW)
    tilt = quat.from_axis_angle(left, _limited(pitch))
    return quat.mul(quat.yaw(_limited(yaw)), tilt)


def _limited(angle: Array) -> Array:
    """The angle in radians, limited smoothly to MOST_TILT. Small angles hardly change."""
    return angle / (1 + (angle / MOST_TILT) ** 6) ** (1 / 6)


def standing_runs(point: Array, slow: float, shortest: int) -> list[tuple[int, int]]:
    """The runs of frames in which a point (F, 3) is slower than `slow`, cm a frame.

    Returns the first frame of each run and the frame after its last. shortest: runs of fewer frames are left
    out.
    """
    speed = np.linalg.norm(np.diff(point, axis=0), axis=1)
    still = np.concatenate([[False], speed < slow, [False]])
    starts = np.flatnonzero(~still[:-1] & still[1:])
    ends = np.flatnonzero(still[:-1] & ~still[1:]) + 1
    return [(int(a), int(b)) for a, b in zip(starts, ends, strict=True) if b - a >= shortest]


def _bridged(values: Array, runs: list[tuple[int, int]], ramp: int) -> Array:
    """(F, 3) numbers that equal `values` (F, 3) within the runs and are smooth between them.

    They fade out over `ramp` frames after a run and fade in over `ramp` frames before the next. Between runs
    that are at most two ramps apart, they change smoothly from the last value of one run to the first value
    of the next. runs: as `standing_runs` returns them.
    """
    # Keyframes and the numbers there. All frames of the runs are keyframes. So are the ends of the ramps,
    # with 0.
    key_frames: list[int] = [-ramp - 1]
    key_values: list[Array] = [np.zeros((1, 3))]
    for first, stop in runs:
        if first - key_frames[-1] > 2 * ramp:
            key_frames += [key_frames[-1] + ramp, first - ramp]
            key_values.append(np.zeros((2, 3)))
        key_frames += range(first, stop)
        key_values.append(values[first:stop])
    key_frames += [key_frames[-1] + ramp, max(len(values), key_frames[-1] + ramp) + 1]
    key_values.append(np.zeros((2, 3)))
    keys, key_value, frame = np.array(key_frames), np.concatenate(key_values), np.arange(len(values))
    after = np.searchsorted(keys, frame, side="right")
    share = (frame - keys[after - 1]) / (keys[after] - keys[after - 1])
    share = (share * share * (3 - 2 * share))[:, None]
    return key_value[after - 1] * (1 - share) + key_value[after] * share
