"""Changes whole clips: resamples, mirrors and repeats them, and repairs broken frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, other_side
from hobble.motion.axes import turned_about_vertical
from hobble.motion.root import facing_directions


def resample(clip: Clip, fps: float) -> Clip:
    """The clip at another frame rate. New frames at the times of old frames are exactly equal to these."""
    if clip.fps == fps:
        return clip
    times = sample_times(len(clip), clip.fps, fps)
    return replace(
        clip,
        fps=fps,
        rotations=sample_rotations(clip.rotations, times),
        root=sample_positions(clip.root, times),
        translations=None if clip.translations is None else sample_positions(clip.translations, times),
    )


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


# Mirrors a motion in the plane x = 0: negates x, and swaps the joints of the left and right side.


# A position, or a rotation (w, x, y, z), is mirrored in the plane x = 0 if it is multiplied by this.
MIRRORED, MIRRORED_ROTATION = np.array([-1.0, 1.0, 1.0]), np.array([1.0, 1.0, -1.0, -1.0])


def mirror_skeleton(skeleton: Skeleton) -> Skeleton:
    """The skeleton with left and right swapped: a symmetric skeleton stays the same.

    Raises HobbleError if two joints are counterparts (such as left and right knee), but their parents are
    not.
    """
    swap = skeleton.mirror_joints
    for j, p in enumerate(skeleton.parents):
        if p >= 0 and skeleton.parents[swap[j]] != swap[p]:
            a, b = skeleton.joints[j], skeleton.joints[swap[j]]
            why = f"the parents of {a} and {b} are not counterparts on the left and on the right"
            raise HobbleError(f"skeleton {skeleton.name} cannot be mirrored: {why}")
    ends = {}
    for name in skeleton.end_sites:
        # A joint without a counterpart keeps its own end site, mirrored.
        x, y, z = skeleton.end_sites.get(other_side(name), skeleton.end_sites[name])
        ends[name] = (-x, y, z)
    return replace(skeleton, offsets=skeleton.offsets[swap] * MIRRORED, end_sites=ends)


def mirror_clip(clip: Clip, name: str) -> Clip:
    """The clip mirrored in the plane x = 0. name: of the mirrored clip."""
    swap = clip.skeleton.mirror_joints
    translations = None if clip.translations is None else clip.translations[:, swap] * MIRRORED
    return Clip(
        name,
        mirror_skeleton(clip.skeleton),
        clip.fps,
        clip.rotations[:, swap] * MIRRORED_ROTATION,
        clip.root * MIRRORED,
        translations,
    )


def mirror_report(report: Mapping[str, Any], name: str) -> dict[str, Any]:
    """The report of a mirrored clip. report: the report of the original clip. name: of the mirrored clip."""
    return {**report, "clip": name, "mirror_of": report["clip"], "facing": 0.0 - report["facing"]}


# Plays a clip of one gait cycle several times in a row, and blends the seams between the repetitions.


SEAM_BLEND = 0.2  # seconds before and after a seam over which it is blended; doubled until the seam is smooth
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
    reach = max(2, min(round(SEAM_BLEND * clip.fps), len(cycle) // 2))
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


# Finds broken frames, and cuts them off, bridges them or smooths them.
#
# A joint of a living body changes its velocity little between frames. A large change is an error of the file:
# a rest pose or zeros as first or last frame, a teleport, a jump at the seam of a loop, a single wrong frame.
# In sentences for users the first frame is frame 1, but in the code it is frame 0.


# A step is the movement of a joint from one frame to the next. At f Hz it is a jump if it differs from the
# neighbouring steps by more than JUMP + JUMP_AT_30 * (30 / f)^2 cm. The limit is higher at low frame rates,
# because velocities change more between frames there.
JUMP = 12.0
JUMP_AT_30 = 30.0
# At f Hz a single frame is wrong if a joint is further than GLITCH + GLITCH_AT_30 * (30 / f)^2 cm from the
# mean of its positions in the frames before and after.
GLITCH = 6.5
GLITCH_AT_30 = 8.0
TELEPORT = 30.0  # cm: where the root jumps further than this, the clip is cut instead of smoothed
# Seconds. If there is a jump within HEAD after the clip's beginning or within TAIL before its end, the frames
# before or after the jump are cut off.
HEAD, TAIL = 0.5, 1.0
BRIDGE = 0.25  # seconds: if two jumps are at most this far apart, the frames between can be interpolated
BLEND = 0.1  # seconds on each side of a jump over which the motion is smoothed
# A joint that turns by more than this from one frame to the next spins faster than a living joint can. Above
# 120 Hz the limit is lower, in proportion to the time between frames.
SPIN = np.radians(60.0)
BLOCK = 4096  # frames that are searched at a time, to keep intermediate arrays small
NO_POSE = 0.75  # frames have no pose if more than this share of their joints' rotations are zero


@dataclass(frozen=True)
class Repaired:
    """A clip without its broken frames.

    first: the source's frame (from 0) at which `clip` begins. sentences: one on each repair.
    """

    clip: Clip
    first: int
    sentences: list[str]


@dataclass(frozen=True)
class Jump:
    """A jump between the frame `frame_before` (from 0) and the next.

    size: by how many cm the step of the worst joint differs from its neighbouring steps. joint: name of
    this joint. root_size: by how many cm the root's step differs.
    """

    frame_before: int
    size: float
    joint: str
    root_size: float = field(default=0.0)

    def __str__(self) -> str:
        between = f"between frames {self.frame_before + 1} and {self.frame_before + 2}"
        return f"{self.joint} jumps by {self.size:.0f} cm {between}"


def repair_defects(clip: Clip) -> Repaired:
    """Find broken frames and repair them if possible. A sound clip is returned unchanged."""
    glitches = _find_glitches(clip)
    without_glitches = _copy(clip) if glitches else clip
    sentences = []
    for frame, size, joint in glitches:
        _interpolate(without_glitches, frame, frame)
        sentences.append(
            f"Frame {frame + 1} is off by {size:.0f} cm at {joint}. It was replaced by the mean of the "
            "frames before and after it."
        )
    unpaired, bridges = _pair_jumps(without_glitches, find_jumps(without_glitches))
    if not unpaired and not bridges:
        return Repaired(without_glitches, 0, sentences)
    first, last = _cut_short_ends(len(clip), clip.fps, unpaired)
    # Teleports divide the clip. Only the longest part remains.
    teleports = [
        jump.frame_before
        for jump in unpaired
        if jump.root_size > TELEPORT and first <= jump.frame_before < last
    ]
    ends = [first - 1, *teleports, last]
    first, last = max(((a + 1, b) for a, b in pairwise(ends)), key=lambda part: part[1] - part[0])
    mended = _copy(without_glitches)
    for start, end, jump in bridges:
        _interpolate(mended, start, end)
        if first <= start <= end <= last:
            sentences.append(f"{jump}; {_number_frames(start, end)} were bridged by interpolation.")
    for jump in unpaired:
        if first <= jump.frame_before < last:
            _smooth(mended, jump.frame_before)
            sentences.append(f"{jump}; the motion was smoothed over {BLEND:g} s on each side.")
    if first > 0:
        sentences.append(_cut_sentence(clip, 0, first - 1, unpaired, first - 1))
    if last < len(clip) - 1:
        sentences.append(_cut_sentence(clip, last + 1, len(clip) - 1, unpaired, last))
    return Repaired(_part(mended, first, last), first, sentences)


def find_jumps(clip: Clip) -> list[Jump]:
    """The jumps of a clip.

    In a jump, the step of a joint differs by more than the limit from the median of seven steps: the three
    before it, itself, and the three after it.
    """
    if len(clip) < 3:
        return []
    limit = JUMP + JUMP_AT_30 * (30.0 / clip.fps) ** 2
    jumps = []
    for first in range(0, len(clip) - 1, BLOCK):
        # Three more steps on each side, so that medians at the edge of a block are right.
        start = max(0, first - 3)
        steps = np.diff(clip.positions[start : first + BLOCK + 4], axis=0)
        sizes = np.linalg.norm(steps - _running_median(steps, 3), axis=-1)
        for i in np.flatnonzero(sizes.max(axis=1) > limit):
            if first <= start + i < first + BLOCK:
                joint = clip.skeleton.joints[int(sizes[i].argmax())]
                jumps.append(Jump(int(start + i), float(sizes[i].max()), joint, float(sizes[i, 0])))
    return jumps


def _running_median(values: Array, reach: int) -> Array:
    """For each frame of (F, ...) values, the median from `reach` frames before it to `reach` frames after it.

    Beyond the ends the values are mirrored.
    """
    index = np.abs(np.arange(-reach, len(values) + reach))
    index = np.where(index >= len(values), 2 * (len(values) - 1) - index, index)
    padded = values[np.clip(index, 0, len(values) - 1)]
    windows = np.stack([padded[k : k + len(values)] for k in range(2 * reach + 1)])
    return np.median(windows, axis=0)


def _find_glitches(clip: Clip) -> list[tuple[int, float, str]]:
    """Each single wrong frame: its index, by how many cm the worst joint is off, and this joint's name."""
    if len(clip) < 5:
        return []
    limit = GLITCH + GLITCH_AT_30 * (30.0 / clip.fps) ** 2
    size, joint = np.zeros(len(clip)), np.zeros(len(clip), int)
    for first in range(1, len(clip) - 1, BLOCK):
        p = clip.positions[first - 1 : first + BLOCK + 1]
        off = np.linalg.norm(p[1:-1] - 0.5 * (p[:-2] + p[2:]), axis=-1)
        size[first : first + len(off)], joint[first : first + len(off)] = off.max(axis=1), off.argmax(axis=1)
    # Where the motion jumps, two frames are equally far off. A wrong frame is twice as far off as its
    # neighbours. The limit of 1.5 lies between the two cases.
    alone = size[1:-1] > 1.5 * np.maximum(size[:-2], size[2:])
    alone[[0, -1]] = False  # these frames have a neighbour at an end of the clip, whose size is unknown
    found = np.flatnonzero((size[1:-1] > limit) & alone) + 1
    return [(int(i), float(size[i]), clip.skeleton.joints[joint[i]]) for i in found]


def notes_on_flips(clip: Clip, first: int) -> list[str]:
    """A sentence for each joint that spins faster than a living joint can.

    Thumbs and end joints of captured rigs spin like this, because markers do not show how these joints are
    turned. first: the source's frame (from 0) at which the clip begins.
    """
    limit = SPIN * min(1.0, 120.0 / clip.fps)
    sentences = []
    for j, name in enumerate(clip.skeleton.joints):
        q = clip.rotations[:, j]
        # The dot product of two unit quaternions is the cosine of half the angle between them.
        half_angle = np.arccos(np.clip(np.abs(np.sum(q[1:] * q[:-1], axis=-1)), 0.0, 1.0))
        too_fast = np.flatnonzero(2 * half_angle > limit)
        if len(too_fast):
            most, frame = np.degrees(2 * half_angle.max()), first + int(too_fast[0]) + 1
            sentences.append(
                f"{name} spins by up to {most:.0f} degrees from one frame to the next, {len(too_fast)} times "
                f"(first between frames {frame} and {frame + 1}); left as it is."
            )
    return sentences


def _cut_short_ends(frames: int, fps: float, jumps: list[Jump]) -> tuple[int, int]:
    """First and last frame that remain when the frames before an early jump and after a late one are cut off.

    HEAD and TAIL define an early and a late jump. At least about half of the clip remains. frames: number of
    the clip's frames.
    """
    first, last = 0, frames - 1
    head = [
        j.frame_before
        for j in jumps
        if j.frame_before + 1 <= HEAD * fps and 2 * (j.frame_before + 1) <= frames
    ]
    if head:
        first = head[-1] + 1
    tail = [
        j.frame_before
        for j in jumps
        if last - j.frame_before <= TAIL * fps and j.frame_before - first > frames // 2
    ]
    return first, tail[0] if tail else last


def _number_frames(start: int, end: int) -> str:
    """Frames in words for users, who count from 1. start, end: first and last frame, counted from 0."""
    return f"frames {start + 1} to {end + 1}" if end > start else f"frame {start + 1}"


def _cut_sentence(clip: Clip, start: int, end: int, jumps: list[Jump], after: int) -> str:
    """Says in words that the frames `start` to `end` were cut off, at the jump that follows frame `after`."""
    jump = next(j for j in jumps if j.frame_before == after)
    unrotated = np.abs(quat.positive(clip.rotations[start : end + 1]) - quat.IDENTITY).max(axis=-1) < 1e-6
    what = " (no pose)" if unrotated.mean() > NO_POSE else ""
    return f"{_number_frames(start, end).capitalize()}{what} cut off: {jump}."


def _pair_jumps(clip: Clip, jumps: list[Jump]) -> tuple[list[Jump], list[tuple[int, int, Jump]]]:
    """Find pairs of jumps with a few broken frames between them.

    Two jumps are a pair if the motion after the second continues the motion before the first. Returns two
    lists: the jumps in no pair, and for each pair its first and last broken frame and its first jump.
    """
    unpaired: list[Jump] = []
    bridges = []
    step = np.linalg.norm(np.diff(clip.positions, axis=0), axis=-1).max(axis=1)
    usual = float(np.median(step)) if len(step) else 0.0
    i = 0
    while i < len(jumps):
        before = jumps[i].frame_before
        last_broken = jumps[i + 1].frame_before if i + 1 < len(jumps) else len(clip)
        after = last_broken + 1
        if last_broken - before <= BRIDGE * clip.fps and after < len(clip):
            apart = np.linalg.norm(clip.positions[after] - clip.positions[before], axis=-1).max()
            # Sound motion may go at three times the clip's usual speed from the one frame to the other.
            if apart < JUMP + 3 * usual * (after - before):
                bridges.append((before + 1, last_broken, jumps[i]))
                i += 2
                continue
        unpaired.append(jumps[i])
        i += 1
    return unpaired, bridges


def _copy(clip: Clip) -> Clip:
    """A copy whose arrays may be changed until its `positions` are first read.

    After that a change would not reach `positions`, because they are computed only once.
    """
    moved = clip.translations
    return replace(
        clip,
        rotations=clip.rotations.copy(),
        root=clip.root.copy(),
        translations=None if moved is None else moved.copy(),
    )


def _interpolate(clip: Clip, start: int, end: int) -> None:
    """Replace the frames `start` to `end` by interpolation between the frame before and the frame after.

    clip: from `_copy`. Its arrays are changed.
    """
    before, after, broken = start - 1, end + 1, slice(start, end + 1)
    share = (np.arange(start, end + 1) - before) / (after - before)
    rotations, root, moved = clip.rotations, clip.root, clip.translations
    rotations[broken] = quat.slerp(rotations[before][None], rotations[after][None], share[:, None])
    root[broken] = root[before] + (root[after] - root[before]) * share[:, None]
    if moved is not None:
        moved[broken] = moved[before] + (moved[after] - moved[before]) * share[:, None, None]


def _smooth(clip: Clip, before: int) -> None:
    """Smooth the jump between frame `before` and the next.

    Half of the difference is added to the frames before the jump and half is subtracted from the frames after
    it. Both halves fade out over BLEND seconds. How far the root jumps over the ground is subtracted from all
    later frames, so that the root's path has no gap. clip: from `_copy`. Its arrays are changed.
    """
    after = before + 1
    reach = max(2, round(BLEND * clip.fps))
    apart = quat.log(quat.mul(quat.inv(clip.rotations[before]), clip.rotations[after]))
    near = slice(max(0, after - reach), min(len(clip), after + reach))
    n = np.arange(near.start, near.stop)
    fade = np.clip(1 - np.where(n <= before, before - n, n - after) / reach, 0.0, 1.0)
    weight = np.where(n <= before, 0.5, -0.5) * fade * fade * (3 - 2 * fade)  # a smooth step from 0 to 1
    clip.rotations[near] = quat.mul(clip.rotations[near], quat.exp(weight[:, None, None] * apart))
    root = clip.root
    # The usual step is no part of the jump.
    usual = np.median(np.diff(root[max(0, before - 3) : after + 4], axis=0), axis=0)
    jump = root[after] - root[before] - usual
    root[near] += weight[:, None] * jump * [0, 1, 0]
    root[after:] -= jump * [1, 0, 1]


def _part(clip: Clip, first: int, last: int) -> Clip:
    """The frames `first` to `last` of a clip."""
    part = slice(first, last + 1)
    moved = clip.translations
    return replace(
        clip,
        rotations=quat.continuous(clip.rotations[part]),
        root=clip.root[part],
        translations=None if moved is None else moved[part],
    )
