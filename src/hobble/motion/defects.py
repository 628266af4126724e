"""Finds broken frames, and cuts them off, bridges them or smooths them.

A joint of a living body changes its velocity little between frames. A large change is an error of the file: a
rest pose or zeros as first or last frame, a teleport, a jump at the seam of a loop, a single wrong frame.
In sentences for users the first frame is frame 1, but in the code it is frame 0.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array

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
FLIP = np.radians(60.0)
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
    limit = FLIP * min(1.0, 120.0 / clip.fps)
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
