"""Changes whole clips: resamples, mirrors and repeats them, and repairs broken frames."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, other_side
from hobble.core.smooth import smoothstep
from hobble.motion.axes import FLIP, MIRROR
from hobble.motion.root import facing_directions

# Loops.
SEAM = 0.2  # seconds before and after a seam over which it is blended; doubled until the seam is smooth
FASTEST = 1.3  # a seam is smooth if no joint is faster than this times the highest speed in the clip
TURNING = np.radians(20.0)  # a cycle in which the body turns by no more than this counts as straight

# Defects. A step is the movement of a joint from one frame to the next. At f Hz it is a jump if it differs
# from the neighbouring steps by more than JUMP + JUMP_AT_30 * (30 / f)^2 cm. The limit is higher at low frame
# rates, because velocities change more between frames there.
JUMP, JUMP_AT_30 = 12.0, 30.0
# At f Hz a single frame is wrong if a joint is further than GLITCH + GLITCH_AT_30 * (30 / f)^2 cm from the
# mean of its positions in the frames before and after.
GLITCH, GLITCH_AT_30 = 6.5, 8.0
TELEPORT = 30.0  # cm: where the root jumps further than this, the clip is cut instead of smoothed
# Seconds. If there is a jump within HEAD after the clip's beginning or within TAIL before its end, the frames
# before or after the jump are cut off.
HEAD, TAIL = 0.5, 1.0
BRIDGE = 0.25  # seconds: if two jumps are at most this far apart, the frames between can be interpolated
BLEND = 0.1  # seconds on each side of a jump over which the motion is smoothed
NO_POSE = 0.75  # frames have no pose if more than this share of their joints' rotations are zero


def resample(clip: Clip, fps: float) -> Clip:
    """The clip at another frame rate: positions interpolated linearly, rotations spherically.

    New frames at the times of old frames are exactly equal to these.
    """
    if clip.fps == fps:
        return clip
    times = sample_times(len(clip), clip.fps, fps)
    first = np.floor(times + 1e-9).astype(int)
    share = np.clip(times - first, 0.0, 1.0)
    share[share < 1e-9] = 0.0
    a, b = clip.part(first), clip.part(np.where(share > 0, first + 1, first))
    rotations = a.rotations
    if share.any():
        rotations = quat.slerp(a.rotations, b.rotations, share[:, None])
        rotations[share == 0] = a.rotations[share == 0]
        rotations = quat.normalize(rotations)
    root = a.root * (1 - share[:, None]) + b.root * share[:, None]
    moved, weight = a.translations, share[:, None, None]
    if moved is not None and b.translations is not None:
        moved = moved * (1 - weight) + b.translations * weight
    return replace(clip, fps=fps, rotations=quat.continuous(rotations), root=root, translations=moved)


def sample_times(frames: int, source_fps: float, fps: float) -> Array:
    """(N,) times of the new frames, counted in source frames, from 0 to the last that is within the clip.

    frames: number of source frames.

    >>> sample_times(5, 120, 60)
    array([0., 2., 4.])
    """
    last = int(np.floor((frames - 1) * fps / source_fps + 1e-6))
    return np.minimum(np.arange(last + 1) * (source_fps / fps), frames - 1)


def mirror_skeleton(skeleton: Skeleton) -> Skeleton:
    """The skeleton with left and right swapped: a symmetric skeleton stays the same.

    Raises HobbleError if two joints are counterparts (such as left and right knee), but their parents are
    not.
    """
    swap = skeleton.mirror_joints
    for j, p in enumerate(skeleton.parents):
        if p >= 0 and skeleton.parents[swap[j]] != swap[p]:
            a, b = skeleton.joints[j], skeleton.joints[swap[j]]
            problem = f"skeleton {skeleton.name} cannot be mirrored"
            raise HobbleError(f"{problem}: the parents of {a} and {b} are no counterparts")
    ends = {}
    for name in skeleton.end_sites:
        # A joint without a counterpart keeps its own end site, mirrored.
        x, y, z = skeleton.end_sites.get(other_side(name), skeleton.end_sites[name])
        ends[name] = (-x, y, z)
    return replace(skeleton, offsets=skeleton.offsets[swap] * FLIP, end_sites=ends)


def mirror_clip(clip: Clip, name: str) -> Clip:
    """The clip mirrored in the plane x = 0. name: of the mirrored clip."""
    swap, skeleton = clip.skeleton.mirror_joints, mirror_skeleton(clip.skeleton)
    rotations = clip.rotations[:, swap] * MIRROR
    moved = None if clip.translations is None else clip.translations[:, swap] * FLIP
    return Clip(name, skeleton, clip.fps, rotations, clip.root * FLIP, moved)


def mirror_report(report: Mapping[str, Any], name: str) -> dict[str, Any]:
    """The report of a mirrored clip. report: the report of the original clip. name: of the mirrored clip."""
    return {**report, "clip": name, "mirror_of": report["clip"], "facing": 0.0 - report["facing"]}


def loop_clip(clip: Clip, times: int) -> Clip:
    """Repeat a clip of one cycle `times` times. Each repetition starts where the last one ended.

    The last frame of the clip may show the same pose as its first one, or the pose before it. Raises
    HobbleError for a clip of less than four frames.
    """
    if len(clip) < 4:
        raise HobbleError(f"{clip.name}: {len(clip)} frames are too few for a cycle, which needs 4 at least")
    first, second, last = (_pose(clip, i) for i in (0, 1, -1))
    step, gap = (np.linalg.norm(first - other, axis=-1).mean() for other in (second, last))
    cycle = clip.part(slice(0, -1)) if gap < 0.5 * step else clip
    turn, shift = _move_between_cycles(cycle)
    reach = max(2, min(round(SEAM * clip.fps), len(cycle) // 2))
    while True:
        looped = _repeat(_blended(cycle, turn, reach), turn, shift, times)
        seam_speed = _top_speed(looped.positions[: 2 * len(cycle) + 1])
        if reach >= len(cycle) // 2 or seam_speed <= FASTEST * _top_speed(clip.positions):
            return looped
        reach = min(2 * reach, len(cycle) // 2)


def _pose(clip: Clip, frame: int) -> Array:
    """(J, 3) positions of the joints relative to the ground below the hips, turned to face +Z."""
    place = clip.positions[frame] - clip.positions[frame, 0] * [1, 0, 1]
    return quat.rotate(quat.yaw(-facing_angle(clip, frame)), place)


def facing_angle(clip: Clip, frame: int) -> float:
    """The facing direction in a frame, radians from +Z towards +X."""
    ahead = facing_directions(clip.skeleton, clip.positions[[frame]], 0.0)[0]
    return float(np.arctan2(ahead[0], ahead[2]))


def _move_between_cycles(cycle: Clip) -> tuple[float, Array]:
    """How the root of a cycle must be moved to start the next one: a turn and a shift.

    turn: radians about Y, through the origin, between -pi and pi. shift: (3,) cm over the ground, after the
    turn.
    """
    turn = (facing_angle(cycle, -1) - facing_angle(cycle, 0) + np.pi) % (2 * np.pi) - np.pi
    turn = float(turn) if abs(turn) > TURNING else 0.0
    # The next cycle begins one frame after the last one of this cycle.
    arrival = cycle.root[-1] + np.median(np.diff(cycle.root[-4:], axis=0), axis=0)
    shift = arrival - quat.rotate(quat.yaw(turn), cycle.root[0])
    return turn, shift * [1, 0, 1]


def _blended(cycle: Clip, turn: float, reach: int) -> Clip:
    """The cycle, changed so that its end leads into its start.

    Half of the difference between end and start is removed at each of them. The change fades out over `reach`
    frames. turn: radians by which the next cycle is turned.
    """
    # The pose one frame after the end is extrapolated. It should be the first pose of the next cycle.
    first = cycle.rotations[0].copy()
    first[0] = quat.mul(quat.yaw(turn), first[0])
    after_last = quat.slerp(cycle.rotations[-2], cycle.rotations[-1], np.array(2.0))
    gaps = quat.log(quat.mul(quat.inv(after_last), first))
    height_gap = cycle.root[0, 1] - (2 * cycle.root[-1, 1] - cycle.root[-2, 1])
    n = np.arange(len(cycle))
    near_end, near_start = np.clip(1 - (len(cycle) - n) / reach, 0, 1), np.clip(1 - n / reach, 0, 1)
    # The share of the gap that is added to each frame: from -.5 at the start to almost .5 at the end.
    weight = 0.5 * (smoothstep(near_end) - smoothstep(near_start))
    moved = cycle.translations
    return replace(
        cycle,
        rotations=quat.mul(cycle.rotations, quat.exp(weight[:, None, None] * gaps)),
        root=cycle.root + weight[:, None] * height_gap * np.array([0.0, 1.0, 0.0]),
        translations=None if moved is None else moved + weight[:, None, None] * (moved[0] - moved[-1]),
    )


def _repeat(cycle: Clip, turn: float, shift: Array, times: int) -> Clip:
    """The cycle played `times` times. turn, shift: the result of `_move_between_cycles`."""
    rotations, roots, place = np.tile(cycle.rotations, (times, 1, 1)), [], np.zeros(3)
    for k in range(times):
        yaw, frames = quat.yaw(k * turn), slice(k * len(cycle), (k + 1) * len(cycle))
        rotations[frames, 0] = quat.mul(yaw, rotations[frames, 0])
        roots.append(quat.rotate(yaw, cycle.root) + place)
        place = place + quat.rotate(yaw, shift)
    moved = None if cycle.translations is None else np.tile(cycle.translations, (times, 1, 1))
    return replace(
        cycle, rotations=quat.continuous(rotations), root=np.concatenate(roots), translations=moved
    )


def _top_speed(positions: Array) -> float:
    """The highest speed of any joint, cm a frame. positions: (F, J, 3)."""
    return float(np.linalg.norm(np.diff(positions, axis=0), axis=-1).max())


@dataclass(frozen=True)
class Jump:
    """A jump between the frame `before` (from 0) and the next. In sentences, the first frame is frame 1.

    size: by how many cm the step of the worst joint differs from its neighbouring steps. joint: name of
    this joint. root_size: by how many cm the root's step differs.
    """

    before: int
    size: float
    joint: str
    root_size: float

    def __str__(self) -> str:
        between = f"between frames {self.before + 1} and {self.before + 2}"
        return f"{self.joint} jumps by {self.size:.0f} cm {between}"


def repair_defects(clip: Clip) -> tuple[Clip, int, list[str]]:
    """Find broken frames, and cut them off, bridge them or smooth them.

    A joint of a living body changes its velocity little between frames. A large change is an error of the
    file: a rest pose or zeros as first or last frame, a teleport, a jump at the seam of a loop, a single
    wrong frame. Returns the clip, its first frame in the source (from 0), and a sentence on each repair. A
    sound clip is returned unchanged.
    """
    sentences = []
    glitches = _find_glitches(clip)
    mended = _copy(clip) if glitches else clip
    for frame, size, joint in glitches:
        _interpolate(mended, frame, frame)
        off = f"Frame {frame + 1} is off by {size:.0f} cm at {joint}"
        sentences.append(f"{off}. It was replaced by the mean of the frames before and after it.")
    jumps, bridges = _pair_jumps(mended, find_jumps(mended))
    if not jumps and not bridges:
        return mended, 0, sentences
    first, last = _longest_part(len(clip), clip.fps, jumps)
    mended = _copy(mended)
    for start, end, jump in bridges:
        _interpolate(mended, start, end)
        if first <= start <= end <= last:
            sentences.append(f"{jump}; {_number_frames(start, end)} were bridged by interpolation.")
    for jump in jumps:
        if first <= jump.before < last:
            _smooth(mended, jump.before)
            sentences.append(f"{jump}; the motion was smoothed over {BLEND:g} s on each side.")
    for start, end, after in ((0, first - 1, first - 1), (last + 1, len(clip) - 1, last)):
        if start <= end:
            jump = next(jump for jump in jumps if jump.before == after)
            turns = np.abs(quat.positive(clip.rotations[start : end + 1]) - quat.IDENTITY).max(axis=-1)
            what = " (no pose)" if np.mean(turns < 1e-6) > NO_POSE else ""
            sentences.append(f"{_number_frames(start, end).capitalize()}{what} cut off: {jump}.")
    part = mended.part(slice(first, last + 1))
    return replace(part, rotations=quat.continuous(part.rotations)), first, sentences


def find_jumps(clip: Clip) -> list[Jump]:
    """The jumps of a clip.

    In a jump, the step of a joint differs by more than the limit from the median of seven steps: the three
    before it, itself, and the three after it.
    """
    from scipy.ndimage import median_filter  # imported here because most jobs do not need it

    if len(clip) < 3:
        return []
    steps = np.diff(clip.positions, axis=0)
    sizes = np.linalg.norm(steps - median_filter(steps, size=(7, 1, 1), mode="mirror"), axis=-1)
    found = np.flatnonzero(sizes.max(axis=1) > JUMP + JUMP_AT_30 * (30.0 / clip.fps) ** 2)
    worst = sizes[found].argmax(axis=1)
    return [
        Jump(int(i), float(sizes[i, j]), clip.skeleton.joints[j], float(sizes[i, 0]))
        for i, j in zip(found, worst, strict=True)
    ]


def _find_glitches(clip: Clip) -> list[tuple[int, float, str]]:
    """Each single wrong frame: its index, by how many cm the worst joint is off, and this joint's name."""
    if len(clip) < 5:
        return []
    p = clip.positions
    off = np.linalg.norm(p[1:-1] - 0.5 * (p[:-2] + p[2:]), axis=-1)  # (F - 2, J), from the second frame on
    size = off.max(axis=1)
    # Where the motion jumps, two frames are equally far off. A wrong frame is twice as far off as its
    # neighbours. The limit of 1.5 lies between the two cases. The first and the last frame of `size` have a
    # neighbour at an end of the clip, whose size is unknown.
    alone = size[1:-1] > 1.5 * np.maximum(size[:-2], size[2:])
    limit = GLITCH + GLITCH_AT_30 * (30.0 / clip.fps) ** 2
    found = np.flatnonzero((size[1:-1] > limit) & alone) + 1
    return [(int(i) + 1, float(size[i]), clip.skeleton.joints[off[i].argmax()]) for i in found]


def _longest_part(frames: int, fps: float, jumps: list[Jump]) -> tuple[int, int]:
    """The first and the last frame that remain of a clip with so many frames.

    The frames before an early jump and after a late one are cut off, but at least about half of the clip
    remains. Teleports divide the rest, of which the longest part remains.
    """
    first, last = 0, frames - 1
    for jump in jumps:
        if jump.before + 1 <= HEAD * fps and 2 * (jump.before + 1) <= frames:
            first = jump.before + 1
    late = (j.before for j in jumps if last - j.before <= TAIL * fps and j.before - first > frames // 2)
    last = next(late, last)
    teleports = [j.before for j in jumps if j.root_size > TELEPORT and first <= j.before < last]
    parts = ((a + 1, b) for a, b in pairwise([first - 1, *teleports, last]))
    return max(parts, key=lambda part: part[1] - part[0])


def _number_frames(start: int, end: int) -> str:
    """Frames in words for users, who count from 1. start, end: first and last frame, counted from 0."""
    return f"frames {start + 1} to {end + 1}" if end > start else f"frame {start + 1}"


def _pair_jumps(clip: Clip, jumps: list[Jump]) -> tuple[list[Jump], list[tuple[int, int, Jump]]]:
    """Find pairs of jumps with a few broken frames between them.

    Two jumps are a pair if the motion after the second continues the motion before the first. Returns two
    lists: the jumps in no pair, and for each pair its first and last broken frame and its first jump.
    """
    unpaired: list[Jump] = []
    bridges = []
    usual = np.median(np.linalg.norm(np.diff(clip.positions, axis=0), axis=-1).max(axis=1)) if jumps else 0.0
    rest = list(jumps)
    while rest:
        jump = rest.pop(0)
        after = (rest[0].before if rest else len(clip)) + 1
        if after - 1 - jump.before <= BRIDGE * clip.fps and after < len(clip):
            apart = np.linalg.norm(clip.positions[after] - clip.positions[jump.before], axis=-1).max()
            # Sound motion may go at three times the clip's usual speed from the one frame to the other.
            if apart < JUMP + 3 * usual * (after - jump.before):
                bridges.append((jump.before + 1, after - 1, jump))
                del rest[0]
                continue
        unpaired.append(jump)
    return unpaired, bridges


def _copy(clip: Clip) -> Clip:
    """A copy whose arrays may be changed until its `positions` are first read.

    After that a change would not reach `positions`, because they are computed only once.
    """
    return clip.part(np.arange(len(clip)))


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
    weight = np.where(n <= before, 0.5, -0.5) * smoothstep(fade)
    clip.rotations[near] = quat.mul(clip.rotations[near], quat.exp(weight[:, None, None] * apart))
    root = clip.root
    # The usual step is no part of the jump.
    usual = np.median(np.diff(root[max(0, before - 3) : after + 4], axis=0), axis=0)
    jump = root[after] - root[before] - usual
    root[near] += weight[:, None] * jump * [0, 1, 0]
    root[after:] -= jump * [1, 0, 1]
