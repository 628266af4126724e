"""Derives how joints are turned in a standing pose from the directions of the bones in motion."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.added_joints import Bend
from hobble.motion.body_sample import LEFT, BodySample
from hobble.motion.flat_feet import flat_feet
from hobble.motion.no_neck import lacks_neck, neck_bone
from hobble.motion.orient import frame, mean_rotation, unit
from hobble.motion.spine import SHORT, spine_shares

UP, AHEAD = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
AGREE = np.radians(25.0)  # trunk joints that differ by less have the same rest pose


def from_motion(sample: BodySample, trunk: BodySample, zero: Array | None) -> dict[int, Array]:
    """Joint -> (4,) frame, as `BodySample` defines it, from the directions of the bones in motion.

    trunk: the poses that show how the trunk is turned (`trunk_sample`). zero: (4,) frame of the chest in the
    zero pose, which is used if the rig has no neck. None if nobody could stand in that pose.
    """
    frames = trunk_frames(trunk, zero)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        _arm(sample, frames, side, sign)
        _leg(sample, frames, side)
    return frames | flat_feet(sample)


def bends(sample: BodySample) -> dict[int, Bend]:
    """Hips and chest -> the bone above each; left out where that bone has no length."""
    body, out = sample.body, {}
    above_chest = () if body.arms_on_neck else (*body.neck, body.head)
    for joint, following in ((body.hips, body.trunk), (body.chest, above_chest)):
        if following and sample.length(joint, following[0]) > SHORT:
            bone, axis, left = _bone(sample, joint)
            out[joint] = Bend(following[0], sample.bone(joint, following[0]), frame(bone, axis, left, LEFT))
    return out


def trunk_frames(sample: BodySample, zero: Array | None) -> dict[int, Array]:
    """`from_motion` for hips, trunk, neck and head alone. sample: the poses that show how they are turned."""
    body, frames = sample.body, dict[int, Array]()
    chain = (body.hips, *body.trunk, *body.neck)
    for joint in chain:
        bone, axis, left = _bone(sample, joint)
        if body.trunk and joint == body.chest and lacks_neck(sample):
            bone, axis = neck_bone(sample, left, zero), sample.target.spine.neck
        # For hips and chest, left is more reliable than the bone: limbs begin level there, but spines of
        # captured rigs bend sideways by some degrees.
        carries = joint in (body.hips, body.chest)
        frames[joint] = frame(left, LEFT, bone, axis) if carries else frame(bone, axis, left, LEFT)
    frames[body.head] = _head(sample, frames, chain)
    return frames


def _bone(sample: BodySample, joint: int) -> tuple[Array, Array, Array]:
    """The bone above a joint of trunk or neck, its direction in a standing rest pose, and left: (3,) each.

    Bone and left are in the joint's coordinates.
    """
    body = sample.body
    trunk = (body.hips, *body.trunk)
    chain = (*trunk, *body.neck, body.head)
    lengths = np.array([sample.length(a, b) for a, b in pairwise(chain)])
    share = dict(zip(chain, spine_shares(lengths, body.top_bones), strict=True))
    following = chain[chain.index(joint) + 1 :]
    # A rig with many short bones has kinks. One bone of the target follows several of them, up to its end.
    reach = [j for j in following if share[j] <= sample.target.spine.end(share[joint]) + 1e-6]
    bone, end = sample.first_long(joint, [*reach[-1:], *following])
    left = sample.chest_left
    if joint == body.hips:
        left = sample.hips_left
    elif joint in trunk and joint != body.chest:
        left = unit(sample.hips_left + sample.chest_left)
    return bone, sample.target.spine.direction(share[joint], share[end]), sample.local(joint, left)


def _head(sample: BodySample, frames: dict[int, Array], chain: Sequence[int]) -> Array:
    """(4,) the rotation of the head: that of the chest if all joints of the trunk have nearly the same one.

    If not, the head is assumed to look ahead on average.
    """
    chest = frames[sample.body.chest]
    if len(chain) > 2 and max(float(quat.angle(frames[j], chest)) for j in chain) < AGREE:
        return chest
    ahead = unit(np.cross(sample.chest_left + sample.hips_left, UP) * [1, 0, 1])
    up = sample.local(sample.body.head, np.broadcast_to(UP, ahead.shape))
    return frame(up, UP, sample.local(sample.body.head, ahead), AHEAD)


def _arm(sample: BodySample, frames: dict[int, Array], side: str, sign: float) -> None:
    clavicle, shoulder, elbow, wrist = sample.body.arms[side]
    chest = quat.mul(sample.turned[:, sample.body.chest], frames[sample.body.chest])
    if clavicle is not None:
        frames[clavicle] = mean_rotation(quat.mul(quat.inv(sample.turned[:, clavicle]), chest))
    hinge = sample.hinge(shoulder, elbow, wrist, -sample.chest_left)
    for start, end in ((shoulder, elbow), (elbow, wrist)):
        frames[start] = frame(sample.bone(start, end), sign * LEFT, sample.local(start, hinge), -sign * UP)
    forearm = quat.mul(sample.turned[:, elbow], frames[elbow])
    frames[wrist] = sample.hand(
        side, mean_rotation(quat.mul(quat.inv(sample.turned[:, wrist]), forearm)), sign
    )


def _leg(sample: BodySample, frames: dict[int, Array], side: str) -> None:
    hip, knee, heel, _ = sample.body.legs[side]
    hinge = sample.hinge(hip, knee, heel, sample.hips_left)
    for start, end in ((hip, knee), (knee, heel)):
        frames[start] = frame(sample.bone(start, end), -UP, sample.local(start, hinge), LEFT)
