"""Plays a clip of one gait cycle several times in a row, and blends the seams between the repetitions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.motion.axes import turned_about_vertical
from hobble.motion.root import facing_directions

BLEND = 0.2  # seconds before and after a seam over which it is blended; doubled until the seam is smooth
FASTEST = 1.3  # a seam is smooth if no joint is faster than this times the highest speed in the clip
TURNING = np.radians(20.0)  # a cycle in which the body turns by no more than this counts as straight
UP = np.array([0.0, 1.0, 0.0])


def loop_clip(clip: Clip, times: int, heading: float | None = None) -> Clip:
    """Repeat a clip of one cycle `times` times. Each repetition starts where the last one ended.

    The last frame of the clip may show the same pose as its first one, or the pose before it. heading: the
    direction in which the first cycle moves, degrees from +Z towards +X; by default as in the clip. Raises
    HobbleError for a clip of less than four frames.
    """
    if len(clip) < 4:
        raise HobbleError(
            f"{clip.name}: {len(clip)} frames are too few to be repeated as a cycle; at least 4 are needed"
        )
    cycle = _without_repeated_pose(clip)
    move = _move_between_cycles(cycle)
    highest_speed = _top_speed(clip)
    reach = max(2, min(round(BLEND * clip.fps), len(cycle) // 2))
    while True:
        looped = _repeat(_blended(cycle, move, reach), move, times)
        if reach >= len(cycle) // 2 or _seam_speed(looped, len(cycle)) <= FASTEST * highest_speed:
            return looped if heading is None else _turn_to_heading(looped, move, np.radians(heading))
        reach = min(2 * reach, len(cycle) // 2)


def _without_repeated_pose(clip: Clip) -> Clip:
    """The clip without its last frame if this shows the same pose as the first one."""
    first, second, last = (_pose(clip, i) for i in (0, 1, -1))
    return (
        _cut(clip, slice(0, -1))
        if _mean_distance(first, last) < 0.5 * _mean_distance(first, second)
        else clip
    )


def _pose(clip: Clip, frame: int) -> Array:
    """(J, 3) positions of the joints relative to the ground below the hips, turned to face +Z."""
    turn = quat.yaw(-_yaw(clip, frame))
    place = clip.positions[frame] - clip.positions[frame, 0] * [1, 0, 1]
    return quat.rotate(turn, place)


def _mean_distance(a: Array, b: Array) -> float:
    return float(np.linalg.norm(a - b, axis=-1).mean())


def _yaw(clip: Clip, frame: int) -> float:
    """The facing direction in a frame, radians from +Z towards +X."""
    ahead = facing_directions(clip.skeleton, clip.positions[[frame]], 0.0)[0]
    return float(np.arctan2(ahead[0], ahead[2]))


def _move_between_cycles(cycle: Clip) -> tuple[float, Array]:
    """How the root of a cycle must be moved to start the next one: a turn and a shift.

    turn: radians about Y, through the origin. shift: (3,) cm over the ground, after the turn.
    """
    # Between -pi and pi.
    turn = (_yaw(cycle, -1) - _yaw(cycle, 0) + np.pi) % (2 * np.pi) - np.pi
    turn = float(turn) if abs(turn) > TURNING else 0.0
    # The next cycle begins one frame after the last one of this cycle.
    step = np.median(np.diff(cycle.root[-4:], axis=0), axis=0)
    arrival = cycle.root[-1] + step
    shift = arrival - quat.rotate(quat.yaw(turn), cycle.root[0])
    return turn, shift * [1, 0, 1]


def _blended(cycle: Clip, move: tuple[float, Array], reach: int) -> Clip:
    """The cycle, changed so that its end leads into its start.

    Half of the difference between end and start is removed at each of them. The change fades out over `reach`
    frames. move: the result of `_move_between_cycles`.
    """
    turn, frames = move[0], len(cycle)
    # The pose one frame after the end is extrapolated. It should be the first pose of the next cycle.
    first = cycle.rotations[0].copy()
    first[0] = quat.mul(quat.yaw(turn), first[0])
    after_last = quat.slerp(cycle.rotations[-2], cycle.rotations[-1], np.array(2.0))
    gaps = quat.log(quat.mul(quat.inv(after_last), first))
    height_gap = cycle.root[0, 1] - (2 * cycle.root[-1, 1] - cycle.root[-2, 1])
    n = np.arange(frames)
    near_end, near_start = np.clip(1 - (frames - n) / reach, 0, 1), np.clip(1 - n / reach, 0, 1)
    # The share of the gap that is added to each frame: from -.5 at the start to almost .5 at the end.
    weight = 0.5 * (_eased(near_end) - _eased(near_start))
    root = cycle.root + weight[:, None] * height_gap * UP
    moved = cycle.translations
    return replace(
        cycle,
        rotations=quat.mul(cycle.rotations, quat.exp(weight[:, None, None] * gaps)),
        root=root,
        translations=None if moved is None else moved + weight[:, None, None] * (moved[0] - moved[-1]),
    )


def _eased(x: Array) -> Array:
    """Numbers from 0 to 1, changed so that they start and end gradually."""
    return x * x * (3 - 2 * x)


def _repeat(cycle: Clip, move: tuple[float, Array], times: int) -> Clip:
    """The cycle played `times` times. move: the result of `_move_between_cycles`."""
    turn, shift = move
    rotations, roots = [], []
    place = np.zeros(3)
    for k in range(times):
        yaw = quat.yaw(k * turn)
        turned_cycle = cycle.rotations.copy()
        turned_cycle[:, 0] = quat.mul(yaw, turned_cycle[:, 0])
        rotations.append(turned_cycle)
        roots.append(quat.rotate(yaw, cycle.root) + place)
        place = place + quat.rotate(yaw, shift)
    moved = cycle.translations
    return replace(
        cycle,
        rotations=quat.continuous(np.concatenate(rotations)),
        root=np.concatenate(roots),
        translations=None if moved is None else np.concatenate([moved] * times),
    )


def _turn_to_heading(clip: Clip, move: tuple[float, Array], heading: float) -> Clip:
    """Turn the clip about the vertical so that its first cycle moves in the direction `heading` (radians).

    A cycle that stays within 1 cm has no direction, and its clip is not turned. move: the result of
    `_move_between_cycles`.
    """
    shift = move[1]
    if np.hypot(shift[0], shift[2]) < 1.0:
        return clip
    return turned_about_vertical(clip, heading - float(np.arctan2(shift[0], shift[2])))


def _top_speed(clip: Clip) -> float:
    """The highest speed of any joint, cm a frame."""
    return float(np.linalg.norm(np.diff(clip.positions, axis=0), axis=-1).max())


def _seam_speed(clip: Clip, cycle: int) -> float:
    """The highest speed of any joint in the first two cycles, with the seam between them, cm a frame.

    cycle: frames in a cycle.
    """
    speed = np.linalg.norm(np.diff(clip.positions, axis=0), axis=-1).max(axis=1)
    return float(speed[: 2 * cycle].max())


def _cut(clip: Clip, frames: slice) -> Clip:
    """The clip with only some of its frames."""
    moved = clip.translations
    return replace(
        clip,
        rotations=clip.rotations[frames],
        root=clip.root[frames],
        translations=None if moved is None else moved[frames],
    )
