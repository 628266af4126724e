"""One figure's motion on another: by joint maps, rest poses and leg lengths, with the feet kept where they
stand.

World rotations carry over relative to the rest poses. Limbs point where the source's limbs point; trunk, head
and feet turn as far from their own rest as the source's do from theirs, so that a flat foot stays flat
whatever the height of its ankle. The path is scaled by the length of the legs, and the balls of the feet
follow the source's, scaled alike, by two-bone inverse kinematics: what does not slide in the source does not
slide in the result.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.ik import aim, two_bone_knee
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations
from hobble.motion.axes import rest_frame, rest_positions
from hobble.motion.rig import leg_length

# Joints that point along a limb: role -> the role at the other end of the bone.
LIMB_BONES = {"shoulder": "elbow", "elbow": "wrist", "hip": "knee", "knee": "heel"}
STANDING = (
    0.8  # cm a frame at 60 Hz: a heel slower than this is treated as standing, at most where it is slow
)
STRAIGHT = 0.5  # cm: a knee nearer than this to the line from hip to ankle is taken to point forward
MOST_TILT = np.radians(6.0) / 2  # half the angle by which a foot is tilted at most


@dataclass(frozen=True)
class Retarget:
    """What it takes to move `target` as `source` moves; made once by `plan`, applied to any pose.

    joints: (M,) target joints that follow a joint of the source. follows: (M,) those joints.
    turns: (M, 4) what comes between them: world rotation of the target = that of the source times this.
    scale: legs of the target to legs of the source. lift: cm added to the height of the hips after scaling.
    """

    source: Skeleton = field(repr=False)
    target: Skeleton = field(repr=False)
    joints: Array
    follows: Array
    turns: Array = field(repr=False)
    scale: float
    lift: float


def plan(source: Skeleton, target: Skeleton, sources: Mapping[str, str]) -> Retarget:
    """Work out how `target` follows `source`; sources: the target's joint -> the joint it follows.

    Both need the roles hips, head and, of both sides, shoulder, hip, knee, heel and toe.
    """
    pairs = [(target.index(mine), source.index(theirs)) for mine, theirs in sources.items()]
    pairs.sort()
    joints = np.array([a for a, _ in pairs])
    follows = np.array([b for _, b in pairs])
    from_source, to_target = rest_frame(source), quat.inv(rest_frame(target))
    turns = np.broadcast_to(quat.mul(from_source, to_target), (len(pairs), 4)).copy()
    bones = _limb_bones(source, target, from_source, to_target)
    for i, (mine, theirs) in enumerate(pairs):
        if (mine, theirs) in bones:
            turns[i] = bones[mine, theirs]
    scale = leg_length(target) / leg_length(source)
    lift = _standing(target, to_target) - scale * _standing(source, quat.inv(from_source))
    return Retarget(source, target, joints, follows, turns, scale, lift)


def _limb_bones(
    source: Skeleton, target: Skeleton, from_source: Array, to_target: Array
) -> dict[tuple[int, int], Array]:
    """(target joint, source joint) of each limb bone -> the turn that makes it point as the source's does."""
    a, b = rest_positions(target), rest_positions(source)
    out = {}
    for side in ("left", "right"):
        for start, end in LIMB_BONES.items():
            roles = f"{side}_{start}", f"{side}_{end}"
            if not all(role in s.roles for role in roles for s in (source, target)):
                continue
            mine, theirs = target.role(roles[0]), source.role(roles[0])
            bone = quat.rotate(to_target, a[target.role(roles[1])] - a[mine])
            wanted = quat.rotate(quat.inv(from_source), b[source.role(roles[1])] - b[theirs])
            turn = quat.mul(quat.between(bone, wanted), to_target)
            out[mine, theirs] = quat.mul(from_source, turn)
    return out


def _standing(skeleton: Skeleton, to_upright: Array) -> float:
    """Height of the hips above the balls of the feet with straight legs, in the skeleton's unit."""
    p = quat.rotate(to_upright, rest_positions(skeleton))[:, 1]
    drop = [p[skeleton.role("hips")] - p[skeleton.role(f"{s}_hip")] for s in ("left", "right")]
    ankle = [p[skeleton.role(f"{s}_heel")] - p[skeleton.role(f"{s}_toe")] for s in ("left", "right")]
    return float(np.mean(drop) + leg_length(skeleton) + np.mean(ankle))


def retarget_clip(clip: Clip, how: Retarget) -> Clip:
    """The clip's motion on the target; joints that follow none keep their rest pose on their parents."""
    root = clip.positions[:, how.source.role("hips")] * how.scale + np.array([0.0, how.lift, 0.0])
    rotations = np.empty((len(clip), len(how.target.joints), 4))
    rotations[:, how.joints] = quat.mul(clip.global_rotations[:, how.follows], how.turns)
    _follow_rigidly(how, rotations)
    placed = _root_position(how.target, rotations, root)
    for side in ("left", "right"):
        toe = clip.positions[:, how.source.role(f"{side}_toe")] * how.scale
        heel = clip.positions[:, how.source.role(f"{side}_heel")] * how.scale
        _hold_heel(how, rotations, side, heel, toe, clip.fps)
        _reach(how, rotations, placed, side, toe)
    _follow_rigidly(how, rotations)
    local = quat.continuous(local_rotations(how.target, rotations))
    return Clip(clip.name, how.target, clip.fps, local, placed)


def _follow_rigidly(how: Retarget, rotations: Array) -> None:
    """Give joints without a motion of their own the world rotation of their parent."""
    moved = set(how.joints.tolist())
    for j, p in enumerate(how.target.parents):
        if j not in moved:
            rotations[:, j] = rotations[:, p] if p >= 0 else quat.IDENTITY


def _root_position(target: Skeleton, rotations: Array, hips: Array) -> Array:
    """Where the root joint is when the hips, which may hang from it, are at `hips`."""
    out = hips.copy()
    j = target.role("hips")
    while target.parents[j] >= 0:
        out -= quat.rotate(rotations[:, target.parents[j]], target.offsets[j])
        j = target.parents[j]
    return out


def _hold_heel(how: Retarget, rotations: Array, side: str, heel: Array, toe: Array, fps: float) -> None:
    """Tilt a standing foot about its ball, by a few degrees, so that its heel moves no more than the
    source's.

    Feet of another shape carry the ankle at another height above the ball, so that the same rocking would
    move it further. heel, toe: (F, 3) those of the source, scaled.
    """
    skeleton = how.target
    joint, ball = skeleton.role(f"{side}_heel"), skeleton.role(f"{side}_toe")
    foot = quat.rotate(rotations[:, joint], rest_positions(skeleton)[ball] - rest_positions(skeleton)[joint])
    length = np.linalg.norm(foot[0])
    apart = toe - foot - heel
    share = np.zeros(len(heel))
    wanted = foot.copy()
    for first, last in standing_runs(heel, STANDING * 60.0 / fps, round(fps / 20)):
        here = slice(first, last)
        level = toe[here] - heel[here] - apart[here].mean(axis=0)
        level[:, 1] = 0.0
        across = np.linalg.norm(level, axis=1, keepdims=True)
        level *= np.minimum(1.0, length / np.maximum(across, 1e-9))
        level[:, 1] = np.sign(foot[here, 1]) * np.sqrt(np.maximum(length**2 - np.sum(level**2, axis=1), 0.0))
        wanted[here] = level
        share[here] = _eased(last - first, round(fps / 15), first == 0, last == len(heel))
    tilt = quat.log(quat.between(foot, wanted))
    size = np.linalg.norm(tilt, axis=-1, keepdims=True)
    tilt *= np.minimum(1.0, MOST_TILT / np.maximum(size, 1e-9)) * share[:, None]
    rotations[:, joint] = quat.mul(quat.exp(tilt), rotations[:, joint])


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


def _reach(how: Retarget, rotations: Array, root: Array, side: str, toe: Array) -> None:
    """Bend a leg so that the ball of the foot gets to `toe` (F, 3); the foot keeps its world rotation."""
    skeleton = how.target
    hip, knee, heel, ball = (skeleton.role(f"{side}_{part}") for part in ("hip", "knee", "heel", "toe"))
    start = _position(skeleton, rotations, root, hip)
    rest = rest_positions(skeleton)
    thigh, shank, foot = rest[knee] - rest[hip], rest[heel] - rest[knee], rest[ball] - rest[heel]
    ankle = toe - quat.rotate(rotations[:, heel], foot)
    pole = _knee_direction(rotations[:, hip], rotations[:, knee], thigh, shank, rest_frame(skeleton))
    lengths = float(np.linalg.norm(thigh)), float(np.linalg.norm(shank))
    middle, end = two_bone_knee(start, ankle, pole, *lengths)
    rotations[:, hip] = aim(rotations[:, hip], thigh, middle - start)
    rotations[:, knee] = aim(rotations[:, knee], shank, end - middle)


def _knee_direction(hip: Array, knee: Array, thigh: Array, shank: Array, rest: Array) -> Array:
    """Where the knee points: off the line from hip to ankle, and, the straighter the leg, forward."""
    along = quat.rotate(hip, thigh)
    line = along + quat.rotate(knee, shank)
    line /= np.linalg.norm(line, axis=-1, keepdims=True)
    bend = along - line * np.sum(along * line, axis=-1, keepdims=True)
    straight = np.clip(STRAIGHT - np.linalg.norm(bend, axis=-1, keepdims=True), 0.0, None)
    return bend + straight * quat.rotate(hip, quat.rotate(rest, np.array([0.0, 0.0, 1.0])))


def _position(skeleton: Skeleton, rotations: Array, root: Array, joint: int) -> Array:
    """World position (F, 3) of one joint, of world rotations (F, J, 4)."""
    out = root.copy()
    while skeleton.parents[joint] >= 0:
        out += quat.rotate(rotations[:, skeleton.parents[joint]], skeleton.offsets[joint])
        joint = skeleton.parents[joint]
    return out
