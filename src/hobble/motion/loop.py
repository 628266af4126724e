"""Repeats a short cycle. Each repetition starts where the last one ended, and the seams are blended."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.motion.axes import turned_about_vertical
from hobble.motion.root import facing

BLEND = 0.2  # seconds on each side of a seam that are blended; doubled until the seam is smooth
FASTEST = 1.3  # highest joint speed at a smooth seam, as a multiple of the highest in the clip
TURNING = np.radians(20.0)  # a cycle that turns by less counts as straight
UP = np.array([0.0, 1.0, 0.0])


def loop_clip(clip: Clip, times: int, heading: float | None = None) -> Clip:
    """The clip repeated `times` times. Each repetition adds the displacement and the turn of one cycle.

    heading: direction of the first cycle, degrees from +Z towards +X; by default as in the clip. The
    clip may end with a repetition of its first frame, or one frame earlier. Raises HobbleError for less than
    four frames.
    """
    if len(clip) < 4:
        raise HobbleError(f"{clip.name}: {len(clip)} frames are too few for a cycle that could be repeated")
    cycle = _open(clip)
    move = _move_between_cycles(cycle)
    top = _top_speed(clip)
    reach = max(2, min(round(BLEND * clip.fps), len(cycle) // 2))
    while True:
        looped = _repeat(_blended(cycle, move, reach), move, times)
        if reach >= len(cycle) // 2 or _seam_speed(looped, len(cycle)) <= FASTEST * top:
            return looped if heading is None else _headed(looped, move, np.radians(heading))
        reach = min(2 * reach, len(cycle) // 2)


def _open(clip: Clip) -> Clip:
    """The cycle without a last frame that repeats the first."""
    first, second, last = (_pose(clip, i) for i in (0, 1, -1))
    return (
        _part(clip, slice(0, -1))
        if _mean_distance(first, last) < 0.5 * _mean_distance(first, second)
        else clip
    )


def _pose(clip: Clip, frame: int) -> Array:
    """(J, 3) joints relative to the ground below the hips, facing +Z."""
    turn = quat.yaw(-_yaw(clip, frame))
    place = clip.positions[frame] - clip.positions[frame, 0] * [1, 0, 1]
    return quat.rotate(turn, place)


def _mean_distance(a: Array, b: Array) -> float:
    return float(np.linalg.norm(a - b, axis=-1).mean())


def _yaw(clip: Clip, frame: int) -> float:
    ahead = facing(clip.skeleton, clip.positions[[frame]], 0.0)[0]
    return float(np.arctan2(ahead[0], ahead[2]))


def _move_between_cycles(cycle: Clip) -> tuple[float, Array]:
    """The movement from one cycle to the next: a turn about Y in radians, then a shift (3,) in cm."""
    turn = (_yaw(cycle, -1) - _yaw(cycle, 0) + np.pi) % (2 * np.pi) - np.pi
    turn = float(turn) if abs(turn) > TURNING else 0.0
    pace = np.median(np.diff(cycle.root[-4:], axis=0), axis=0)
    arrival = cycle.root[-1] + pace
    shift = arrival - quat.rotate(quat.yaw(turn), cycle.root[0])
    return turn, shift * [1, 0, 1]


def _blended(cycle: Clip, move: tuple[float, Array], reach: int) -> Clip:
    """The cycle with ends that fit together: half of their difference is removed at each end.

    The change fades over `reach` frames.
    """
    turn, frames = move[0], len(cycle)
    first = cycle.rotations[0].copy()
    first[0] = quat.mul(quat.yaw(turn), first[0])
    last = quat.slerp(cycle.rotations[-2], cycle.rotations[-1], np.array(2.0))
    gaps = quat.log(quat.mul(quat.inv(last), first))
    height = cycle.root[0, 1] - (2 * cycle.root[-1, 1] - cycle.root[-2, 1])
    n = np.arange(frames)
    before, after = np.clip(1 - (frames - n) / reach, 0, 1), np.clip(1 - n / reach, 0, 1)
    weight = 0.5 * (_eased(before) - _eased(after))
    root = cycle.root + weight[:, None] * height * UP
    moved = cycle.translations
    return replace(
        cycle,
        rotations=quat.mul(cycle.rotations, quat.exp(weight[:, None, None] * gaps)),
        root=root,
        translations=None if moved is None else moved + weight[:, None, None] * (moved[0] - moved[-1]),
    )


def _eased(x: Array) -> Array:
    return x * x * (3 - 2 * x)


def _repeat(cycle: Clip, move: tuple[float, Array], times: int) -> Clip:
    turn, shift = move
    rotations, roots = [], []
    place = np.zeros(3)
    for k in range(times):
        yaw = quat.yaw(k * turn)
        turned = cycle.rotations.copy()
        turned[:, 0] = quat.mul(yaw, turned[:, 0])
        rotations.append(turned)
        roots.append(quat.rotate(yaw, cycle.root) + place)
        place = place + quat.rotate(yaw, shift)
    moved = cycle.translations
    return replace(
        cycle,
        rotations=quat.continuous(np.concatenate(rotations)),
        root=np.concatenate(roots),
        translations=None if moved is None else np.concatenate([moved] * times),
    )


def _headed(clip: Clip, move: tuple[float, Array], heading: float) -> Clip:
    """The clip turned about its start so that a cycle goes in the direction `heading`."""
    shift = move[1]
    if np.hypot(shift[0], shift[2]) < 1.0:
        return clip
    return turned_about_vertical(clip, heading - float(np.arctan2(shift[0], shift[2])))


def _top_speed(clip: Clip) -> float:
    return float(np.linalg.norm(np.diff(clip.positions, axis=0), axis=-1).max())


def _seam_speed(clip: Clip, cycle: int) -> float:
    speed = np.linalg.norm(np.diff(clip.positions, axis=0), axis=-1).max(axis=1)
    return float(speed[: 2 * cycle].max())


def _part(clip: Clip, frames: slice) -> Clip:
    moved = clip.translations
    return replace(
        clip,
        rotations=clip.rotations[frames],
        root=clip.root[frames],
        translations=None if moved is None else moved[frames],
    )
