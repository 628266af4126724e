"""Transfers one figure's motion to another, by joint maps, rest poses and leg lengths.

World rotations are transferred relative to the rest poses. Limbs get the directions of the source's limbs.
Trunk, head and feet turn as far from their rest pose as in the source, so that a flat foot stays flat
whatever the height of its ankle. The path is scaled by leg length of the target / leg length of the source.
Two-bone inverse kinematics puts the balls of the feet where they are in the scaled source, so that feet that
do not slide in the source do not slide in the result. Joints that follow no joint of the source (fingers,
face, roll joints) keep their rest pose relative to the joint above.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import HobbleError
from hobble.core.ik import aim, two_bone_knee
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations, rest_positions
from hobble.motion.axes import rest_frame
from hobble.motion.body import SIDES
from hobble.motion.heel_tilt import steady_heels
from hobble.motion.rig import leg_length, missing_bone

# Bones of limbs: role of the joint -> role of the bone's other end.
LIMB_BONES = {"shoulder": "elbow", "elbow": "wrist", "hip": "knee", "knee": "heel"}
# Distance from hip to ankle, as a share of the leg's length. If the share in the source is NEARLY_STRAIGHT or
# more, the hips come down so that the target's leg is no straighter than the source's. If the share is BENT
# or less, the hips do not come down. Between BENT and NEARLY_STRAIGHT, this rule sets in gradually.
BENT, NEARLY_STRAIGHT = 0.88, 0.95
SMOOTH = 0.08  # seconds before and after a frame over which the drop of its hips is smoothed
MOST_DROP = 6.0  # cm by which the hips come down at most
# cm: a knee nearer than this to the line from hip to ankle hardly shows which way it bends, so its direction
# is mixed with forward.
STRAIGHT = 0.5


@dataclass(frozen=True)
class Retarget:
    """How the skeleton `target` follows the skeleton `source`. Made once by `plan`, applied to any pose.

    joints: (M,) target joints that follow a joint of the source, parents first. follows: (M,) the source
    joints that they follow. turns: (M, 4); the world rotation of a target joint is the world rotation of its
    source joint times its turn. drivers: (J,) for each target joint the nearest of `joints` above it, or the
    joint itself if it is one of them. driver_offsets: (J, 3) cm, position of each joint in the coordinates of
    its driver, or of its parent's driver if the joint is its own driver. levels: the `joints` below the hips,
    in groups in the order in which they are placed. forward: (3,) the direction that the target's rest pose
    faces. pelvis: (3,) cm, from the target's hips to the middle between its two hip joints. scale: leg length
    of the target / leg length of the source. lift: cm by which the target's ankles are higher above the balls
    of its feet than the ankles of the scaled source.
    """

    source: Skeleton = field(repr=False)
    target: Skeleton = field(repr=False)
    joints: Array
    follows: Array
    turns: Array = field(repr=False)
    drivers: Array = field(repr=False)
    driver_offsets: Array = field(repr=False)
    levels: tuple[Array, ...] = field(repr=False)
    forward: Array = field(repr=False)
    pelvis: Array = field(repr=False)
    scale: float
    lift: float


def plan(source: Skeleton, target: Skeleton, sources: Mapping[str, str]) -> Retarget:
    """Plan how `target` follows `source`. sources: joint of the target -> joint of the source.

    Both skeletons need the roles hips and head, and on both sides shoulder, hip, knee, heel and toe. Raises
    HobbleError if the target's hips or legs follow nothing, or if a bone of a leg has no length.
    """
    pairs = sorted((target.index(follower), source.index(leader)) for follower, leader in sources.items())
    joints, follows = (np.array(side) for side in zip(*pairs, strict=True))
    for role in ("hips", *(f"{s}_{part}" for s in SIDES for part in ("hip", "knee", "heel"))):
        if target.role(role) not in joints:
            raise HobbleError(
                f"no joint of {source.name} moves {target.roles[role]} ({role}) of {target.name}"
            )
    for skeleton in (source, target):
        if bone := missing_bone(skeleton):
            raise HobbleError(f"the bone from {bone} of {skeleton.name} has no length")
    from_source, to_target = rest_frame(source), quat.inv(rest_frame(target))
    turns = np.broadcast_to(quat.mul(from_source, to_target), (len(pairs), 4)).copy()
    bones = _limb_bones(source, target, from_source, to_target)
    for i, pair in enumerate(pairs):
        turns[i] = bones.get(pair, turns[i])
    scale = leg_length(target) / leg_length(source)
    drivers, driver_offsets = _drivers(target, joints)
    rest = rest_positions(target)
    middle = 0.5 * (rest[target.role("left_hip")] + rest[target.role("right_hip")])
    return Retarget(
        source=source,
        target=target,
        joints=joints,
        follows=follows,
        turns=turns,
        drivers=drivers,
        driver_offsets=driver_offsets,
        levels=_levels(target, joints, drivers),
        forward=quat.rotate(rest_frame(target), np.array([0.0, 0.0, 1.0])),
        pelvis=middle - rest[target.role("hips")],
        scale=scale,
        lift=_ankle_height(target, to_target) - scale * _ankle_height(source, quat.inv(from_source)),
    )


def _limb_bones(
    source: Skeleton, target: Skeleton, from_source: Array, to_target: Array
) -> dict[tuple[int, int], Array]:
    """(target joint, source joint) of each limb bone -> its turn (4,), which makes the two bones parallel."""
    a, b = rest_positions(target), rest_positions(source)
    out = {}
    for side in SIDES:
        for start, end in LIMB_BONES.items():
            roles = f"{side}_{start}", f"{side}_{end}"
            if not all(role in s.roles for role in roles for s in (source, target)):
                continue
            follower, leader = target.role(roles[0]), source.role(roles[0])
            bone = quat.rotate(to_target, a[target.role(roles[1])] - a[follower])
            source_bone = quat.rotate(quat.inv(from_source), b[source.role(roles[1])] - b[leader])
            turn = quat.between(bone, source_bone)
            out[follower, leader] = quat.mul(from_source, quat.mul(turn, to_target))
    return out


def _ankle_height(skeleton: Skeleton, to_upright: Array) -> float:
    """Height of the ankles above the balls of the feet in the rest pose, in the skeleton's unit.

    to_upright: (4,) rotation that makes the rest pose stand along Y and face +Z.
    """
    p = quat.rotate(to_upright, rest_positions(skeleton))[:, 1]
    return float(np.mean([p[skeleton.role(f"{s}_heel")] - p[skeleton.role(f"{s}_toe")] for s in SIDES]))


def _drivers(target: Skeleton, joints: Array) -> tuple[Array, Array]:
    """`drivers` and `driver_offsets` of a Retarget. Joints above the hips follow the hips."""
    rest, hips = rest_positions(target), target.role("hips")
    drivers = np.full(len(target.joints), hips)
    driver_offsets = np.zeros((len(target.joints), 3))
    for j, p in enumerate(target.parents):
        above = drivers[p] if p >= 0 else hips
        drivers[j] = j if j in joints else above
        driver_offsets[j] = rest[j] - rest[above]
    return drivers, driver_offsets


def _levels(target: Skeleton, joints: Array, drivers: Array) -> tuple[Array, ...]:
    depth = {target.role("hips"): 0}
    for j in joints:
        if j not in depth:
            depth[int(j)] = depth[int(drivers[target.parents[j]])] + 1
    return tuple(np.array([j for j in depth if depth[j] == d]) for d in range(1, max(depth.values()) + 1))


def retarget_clip(clip: Clip, how: Retarget) -> Clip:
    """The clip's motion on the target skeleton."""
    rotations = _carried(how, clip.global_rotations)
    for side in SIDES:
        heel, toe = (clip.positions[:, how.source.role(f"{side}_{part}")] for part in ("heel", "toe"))
        joint, ball = how.target.role(f"{side}_heel"), how.target.role(f"{side}_toe")
        foot = quat.rotate(rotations[:, joint], how.driver_offsets[ball])
        tilt = steady_heels(foot, heel * how.scale, toe * how.scale, clip.fps)
        rotations[:, joint] = quat.mul(tilt, rotations[:, joint])
    positions, rotations = _posed(how, clip.positions, rotations, clip.fps)
    local = quat.continuous(local_rotations(how.target, rotations))
    return Clip(clip.name, how.target, clip.fps, local, positions[:, 0])


def retarget_pose(how: Retarget, positions: Array, rotations: Array) -> tuple[Array, Array]:
    """Transfer poses to the target, such as the pose of a network in each frame of a game.

    positions: (..., J, 3) and rotations: (..., J, 4) of the source's joints in the world. Returns positions
    and rotations of the target's joints in the world.
    """
    return _posed(how, positions, _carried(how, rotations))


def _carried(how: Retarget, rotations: Array) -> Array:
    """World rotations (..., J, 4) of the target. Only those of `how.joints` are set."""
    out = np.empty((*rotations.shape[:-2], len(how.target.joints), 4))
    out[..., how.joints, :] = quat.mul(rotations[..., how.follows, :], how.turns)
    return out


def _posed(how: Retarget, source: Array, rotations: Array, fps: float | None = None) -> tuple[Array, Array]:
    """World positions and rotations of the target's joints, with the feet at the source's scaled positions.

    source: (..., J, 3) world positions of the source's joints. rotations: (..., J, 4) as from `_carried`;
    they are changed in place. fps: frame rate of successive frames, in which the hips come down smoothly, or
    None for single poses.
    """
    hips = _hips(how, source, rotations)
    legs = [_Leg(how, source, rotations, hips, side) for side in SIDES]
    drop = np.max([leg.drop() for leg in legs], axis=0)
    drop = (drop if fps is None else _smoothed(drop, fps))[..., None] * [0.0, 1.0, 0.0]
    hips = hips - drop
    for leg in legs:
        leg.bend(leg.start - drop)
    positions = np.empty((*rotations.shape[:-1], 3))
    positions[..., how.target.role("hips"), :] = hips
    parents = np.array(how.target.parents)
    for level in how.levels:
        above = how.drivers[parents[level]]
        offsets = quat.rotate(rotations[..., above, :], how.driver_offsets[level])
        positions[..., level, :] = positions[..., above, :] + offsets
    driven = np.flatnonzero(how.drivers != np.arange(len(how.drivers)))
    drivers = how.drivers[driven]
    rotations[..., driven, :] = rotations[..., drivers, :]
    offsets = quat.rotate(rotations[..., drivers, :], how.driver_offsets[driven])
    positions[..., driven, :] = positions[..., drivers, :] + offsets
    return positions, rotations


def _hips(how: Retarget, source: Array, rotations: Array) -> Array:
    """Position of the hips that puts the middle between the legs at the source's scaled position.

    The legs and feet must fit; where the hips joint lies in the pelvis differs between skeletons.
    """
    middle = 0.5 * sum(source[..., how.source.role(f"{side}_hip"), :] for side in SIDES)
    arm = quat.rotate(rotations[..., how.target.role("hips"), :], how.pelvis)
    return middle * how.scale + np.array([0.0, how.lift, 0.0]) - arm


def _smoothed(drop: Array, fps: float) -> Array:
    """A smooth curve (F,) that is nowhere below `drop`: a moving average of the running maximum of `drop`."""
    reach = max(1, round(SMOOTH * fps))
    padded = np.pad(drop, 2 * reach, mode="edge")
    highest = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1).max(axis=-1)
    window = np.hanning(2 * reach + 3)[1:-1]
    return np.convolve(highest, window / window.sum(), mode="valid")


class _Leg:
    """A leg of the target, from its hip to the position that the foot must reach.

    source: (..., J, 3) positions of the source's joints. rotations: (..., J, 4) of the target's joints; the
    method `bend` changes the rotations of thigh and shank. hips: (..., 3) position of the target's hips.
    Attributes start and ankle: where the leg begins and where its ankle must be. stretch: distance from hip
    to ankle in the source, as a share of the leg's length.
    """

    def __init__(self, how: Retarget, source: Array, rotations: Array, hips: Array, side: str) -> None:
        roles = [f"{side}_{part}" for part in ("hip", "knee", "heel", "toe")]
        self.hip, self.knee, heel, ball = (how.target.role(role) for role in roles)
        self.forward, self.rotations = how.forward, rotations
        self.thigh, self.shank = how.driver_offsets[self.knee], how.driver_offsets[heel]
        self.start, joint = hips, self.hip
        while joint != how.target.role("hips"):
            above = how.drivers[how.target.parents[joint]]
            self.start = self.start + quat.rotate(rotations[..., above, :], how.driver_offsets[joint])
            joint = above
        toe = source[..., how.source.role(roles[3]), :] * how.scale
        self.ankle = toe - quat.rotate(rotations[..., heel, :], how.driver_offsets[ball])
        a, b, c = (source[..., how.source.role(role), :] for role in roles[:3])
        length = np.linalg.norm(b - a, axis=-1) + np.linalg.norm(c - b, axis=-1)
        self.stretch = np.linalg.norm(c - a, axis=-1) / length

    def drop(self) -> Array:
        """(...) cm by which the hips must come down for the leg to be no straighter than the source's."""
        reach = self.stretch * (np.linalg.norm(self.thigh) + np.linalg.norm(self.shank))
        way = self.start - self.ankle
        level = np.minimum(way[..., 0] ** 2 + way[..., 2] ** 2, reach**2)
        need = np.maximum(way[..., 1] - np.sqrt(reach**2 - level), 0.0)
        share = np.clip((self.stretch - BENT) / (NEARLY_STRAIGHT - BENT), 0.0, 1.0)
        return np.minimum(need, MOST_DROP) * share * share * (3 - 2 * share)

    def bend(self, start: Array) -> None:
        """Turn thigh and shank so that the ankle reaches its position. The foot keeps its rotation."""
        upper, lower = self.rotations[..., self.hip, :], self.rotations[..., self.knee, :]
        pole = _knee_direction(upper, lower, self.thigh, self.shank, self.forward)
        lengths = float(np.linalg.norm(self.thigh)), float(np.linalg.norm(self.shank))
        middle, end = two_bone_knee(start, self.ankle, pole, *lengths)
        self.rotations[..., self.hip, :] = aim(upper, self.thigh, middle - start)
        self.rotations[..., self.knee, :] = aim(lower, self.shank, end - middle)


def _knee_direction(hip: Array, knee: Array, thigh: Array, shank: Array, ahead: Array) -> Array:
    """(..., 3) direction in which the knee is off the line from hip to ankle; forward for a straight leg.

    hip, knee: (..., 4) rotations of these joints. thigh, shank: (3,) bones below them. ahead: (3,) forward in
    the rest pose.
    """
    along = quat.rotate(hip, thigh)
    line = along + quat.rotate(knee, shank)
    line = line / np.linalg.norm(line, axis=-1, keepdims=True)
    bend = along - line * np.sum(along * line, axis=-1, keepdims=True)
    straight = np.clip(STRAIGHT - np.linalg.norm(bend, axis=-1, keepdims=True), 0.0, None)
    return bend + straight * quat.rotate(hip, ahead)
