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

# A step is the way of a joint from one frame to the next. At f Hz it is a jump if it differs from the
# neighbouring steps by more than JUMP + JUMP_AT_30 * (30 / f)^2 cm. At low frame rates, velocities change
# more between frames.
JUMP = 12.0
JUMP_AT_30 = 30.0
# At f Hz a single frame is wrong if a joint is further than GLITCH + GLITCH_AT_30 * (30 / f)^2 cm from the
# mean of its positions in the frames before and after.
GLITCH = 6.5
GLITCH_AT_30 = 8.0
TELEPORT = 30.0  # cm: where the root jumps further than this, the clip is cut instead of smoothed
HEAD, TAIL = 0.5, 1.0  # seconds: shorter pieces before the first and after the last jump are cut off
BRIDGE = 0.25  # seconds: shorter pieces between two jumps are bridged
BLEND = 0.1  # seconds on each side over which a jump of the pose is smoothed
# A joint that turns by more than this from one frame to the next spins faster than a living joint can. Above
# 120 Hz the limit is lower, in proportion to the time between frames.
FLIP = np.radians(60.0)
BLOCK = 4096  # frames that are searched at a time
NO_POSE = 0.75  # in frames without a pose, more than this share of the joints has no rotation


@dataclass(frozen=True)
class Repaired:
    """A clip without its broken frames.

    first: the source's frame (from 0) at which it begins. sentences: one on each repair.
    """

    clip: Clip
    first: int
    sentences: list[str]


@dataclass(frozen=True)
class Jump:
    """A jump between frame `after` and the next.

    size: by how many cm the step of the worst joint differs from its neighbouring steps. joint: name of
    this joint. root_size: the difference for the root, cm.
    """

    after: int
    size: float
    joint: str
    root_size: float = field(default=0.0)

    def __str__(self) -> str:
        between = f"between frames {self.after + 1} and {self.after + 2}"
        return f"{self.joint} jumps by {self.size:.0f} cm {between}"


def repair(clip: Clip) -> Repaired:
    """Find broken frames and repair them if possible. A sound clip is returned unchanged."""
    glitches = _find_glitches(clip)
    draft = _copy(clip) if glitches else clip
    sentences = []
    for frame, size, joint in glitches:
        _interpolate(draft, frame, frame)
        sentences.append(
            f"Frame {frame + 1} is off by {size:.0f} cm at {joint}; the middle of its neighbours replaces it."
        )
    unpaired, bridges = _pairs_of_jumps(draft, find_jumps(draft))
    if not unpaired and not bridges:
        return Repaired(draft, 0, sentences)
    first, last = _without_edges(len(clip), clip.fps, unpaired)
    teleports = [jump.after for jump in unpaired if jump.root_size > TELEPORT and first <= jump.after < last]
    edges = [first - 1, *teleports, last]
    first, last = max(((a + 1, b) for a, b in pairwise(edges)), key=lambda part: part[1] - part[0])
    mended = _copy(draft)
    for start, end, jump in bridges:
        _interpolate(mended, start, end)
        if first <= start <= end <= last:
            sentences.append(f"{jump}; {_frames(start, end)} were bridged by interpolation.")
    for jump in unpaired:
        if first <= jump.after < last:
            _smooth(mended, jump.after)
            sentences.append(f"{jump}; the motion was blended over {BLEND:g} s to each side.")
    if first > 0:
        sentences.append(_cut_sentence(clip, 0, first - 1, unpaired, first - 1))
    if last < len(clip) - 1:
        sentences.append(_cut_sentence(clip, last + 1, len(clip) - 1, unpaired, last))
    return Repaired(_cut(mended, first, last), first, sentences)


def find_jumps(clip: Clip) -> list[Jump]:
    """The jumps of a clip.

    In a jump, the step of a joint is far from the median of seven steps: three before, this one, three after.
    """
    if len(clip) < 3:
        return []
    limit = JUMP + JUMP_AT_30 * (30.0 / clip.fps) ** 2
    jumps = []
    for first in range(0, len(clip) - 1, BLOCK):
        # Three more steps on each side, so that medians at the edge of a block are right.
        start = max(0, first - 3)
        step = np.diff(clip.positions[start : first + BLOCK + 4], axis=0)
        off = np.linalg.norm(step - _running_median(step, 3), axis=-1)
        for i in np.flatnonzero(off.max(axis=1) > limit):
            if first <= start + i < first + BLOCK:
                joint = clip.skeleton.joints[int(off[i].argmax())]
                jumps.append(Jump(int(start + i), float(off[i].max()), joint, float(off[i, 0])))
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
    # neighbours.
    alone = size[1:-1] > 1.5 * np.maximum(size[:-2], size[2:])
    alone[[0, -1]] = False
    found = np.flatnonzero((size[1:-1] > limit) & alone) + 1
    return [(int(i), float(size[i]), clip.skeleton.joints[joint[i]]) for i in found]


def flips(clip: Clip, first: int) -> list[str]:
    """A sentence for each joint that stays in place but spins faster than a living joint can.

    first: the source's frame at which the clip begins. Thumbs and end joints of captured rigs do this,
    because markers do not show how they are turned.
    """
    limit = FLIP * min(1.0, 120.0 / clip.fps)
    sentences = []
    for j, name in enumerate(clip.skeleton.joints):
        q = clip.rotations[:, j]
        half = np.arccos(np.clip(np.abs(np.sum(q[1:] * q[:-1], axis=-1)), 0.0, 1.0))
        after = np.flatnonzero(2 * half > limit)
        if len(after):
            most, frame = np.degrees(2 * half.max()), first + int(after[0]) + 1
            sentences.append(
                f"{name} spins by up to {most:.0f} degrees from one frame to the next, {len(after)} times "
                f"(first between frames {frame} and {frame + 1}); left as it is."
            )
    return sentences


def _without_edges(frames: int, fps: float, jumps: list[Jump]) -> tuple[int, int]:
    """First and last frame that remain when short pieces between an end of the clip and a jump are cut off.

    frames: number of the clip's frames.
    """
    first, last = 0, frames - 1
    head = [j.after for j in jumps if j.after + 1 <= HEAD * fps and 2 * (j.after + 1) <= frames]
    if head:
        first = head[-1] + 1
    tail = [j.after for j in jumps if last - j.after <= TAIL * fps and j.after - first > frames // 2]
    return first, tail[0] if tail else last


def _frames(start: int, end: int) -> str:
    return f"frames {start + 1} to {end + 1}" if end > start else f"frame {start + 1}"


def _cut_sentence(clip: Clip, start: int, end: int, jumps: list[Jump], after: int) -> str:
    jump = next(j for j in jumps if j.after == after)
    still = np.abs(quat.positive(clip.rotations[start : end + 1]) - quat.IDENTITY).max(axis=-1) < 1e-6
    what = " (no pose)" if still.mean() > NO_POSE else ""
    return f"{_frames(start, end).capitalize()}{what} cut off: {jump}."


def _pairs_of_jumps(clip: Clip, jumps: list[Jump]) -> tuple[list[Jump], list[tuple[int, int, Jump]]]:
    """Find pairs of jumps with a few broken frames between them.

    Two jumps are a pair if the motion after the second continues the motion before the first. Returns the
    jumps that are in no pair, and for each pair the first and the last broken frame and its first jump.
    """
    unpaired: list[Jump] = []
    bridges = []
    step = np.linalg.norm(np.diff(clip.positions, axis=0), axis=-1).max(axis=1)
    usual = float(np.median(step)) if len(step) else 0.0
    i = 0
    while i < len(jumps):
        a, b = jumps[i].after, jumps[i + 1].after if i + 1 < len(jumps) else len(clip)
        if b - a <= BRIDGE * clip.fps and b + 1 < len(clip):
            apart = np.linalg.norm(clip.positions[b + 1] - clip.positions[a], axis=-1).max()
            if apart < JUMP + 3 * usual * (b + 1 - a):
                bridges.append((a + 1, b, jumps[i]))
                i += 2
                continue
        unpaired.append(jumps[i])
        i += 1
    return unpaired, bridges


def _copy(clip: Clip) -> Clip:
    """A copy. Its arrays may be changed until its `positions` are first read: these are computed once."""
    moved = clip.translations
    return replace(
        clip,
        rotations=clip.rotations.copy(),
        root=clip.root.copy(),
        translations=None if moved is None else moved.copy(),
    )


def _interpolate(draft: Clip, start: int, end: int) -> None:
    """Replace the frames `start` to `end` by interpolation between the frame before and the frame after."""
    a, b, here = start - 1, end + 1, slice(start, end + 1)
    share = (np.arange(start, end + 1) - a) / (b - a)
    draft.rotations[here] = quat.slerp(draft.rotations[a][None], draft.rotations[b][None], share[:, None])
    draft.root[here] = draft.root[a] + (draft.root[b] - draft.root[a]) * share[:, None]
    if draft.translations is not None:
        step = draft.translations[b] - draft.translations[a]
        draft.translations[here] = draft.translations[a] + step * share[:, None, None]


def _smooth(draft: Clip, after: int) -> None:
    """Smooth the jump between frame `after` and the next.

    Half of the difference is added to the frames before and half is subtracted from the frames after; both
    fade out over BLEND seconds. How far the root jumps over the ground is subtracted from all later frames,
    so that the root's path has no gap.
    """
    a, b = after, after + 1
    reach = max(2, round(BLEND * draft.fps))
    apart = quat.log(quat.mul(quat.inv(draft.rotations[a]), draft.rotations[b]))
    here = slice(max(0, b - reach), min(len(draft), b + reach))
    n = np.arange(here.start, here.stop)
    fade = np.clip(1 - np.where(n <= a, a - n, n - b) / reach, 0.0, 1.0)
    weight = np.where(n <= a, 0.5, -0.5) * fade * fade * (3 - 2 * fade)
    draft.rotations[here] = quat.mul(draft.rotations[here], quat.exp(weight[:, None, None] * apart))
    root = draft.root
    jump = root[b] - root[a] - np.median(np.diff(root[max(0, a - 3) : b + 4], axis=0), axis=0)
    root[here] += weight[:, None] * jump * [0, 1, 0]
    root[b:] -= jump * [1, 0, 1]


def _cut(clip: Clip, first: int, last: int) -> Clip:
    part = slice(first, last + 1)
    moved = clip.translations
    return replace(
        clip,
        rotations=quat.continuous(clip.rotations[part]),
        root=clip.root[part],
        translations=None if moved is None else moved[part],
    )
