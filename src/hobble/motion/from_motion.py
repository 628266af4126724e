"""Finds how a rig's joints are turned on its body, from the directions of the bones in motion.

The result is a frame for each joint: the rotation (4,) from the axes of a figure in a T-pose to the joint's
own axes. In the T-pose, the figure faces +Z, with its arms out sideways. The frame of a joint is the same at
all times. It has nothing to do with the frames of a clip.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.added_joints import Bend
from hobble.motion.body_sample import LEFT, BodySample
from hobble.motion.flat_feet import frames_of_feet
from hobble.motion.no_neck import lacks_neck, neck_bone
from hobble.motion.orient import mean_rotation, rotation_aligning, unit_vectors
from hobble.motion.spine import SHORT, spine_shares

UP, AHEAD = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
KINK = 0.06  # leg lengths: a bone above the chest that is shorter does not show how the chest is turned
AGREE = np.radians(25.0)  # joints of trunk and neck count as turned like the chest if they differ by less


def frames_from_motion(sample: BodySample, trunk: BodySample, zero: Array | None) -> dict[int, Array]:
    """Joint -> its frame (4,), for all joints of the body.

    sample: some moments of the clip. trunk: those of its moments that show how the trunk is turned. zero:
    (4,) frame of the chest according to the zero pose (all rotations zero), or None if nobody could stand in
    that pose. It is needed for rigs without a neck.
    """
    frames = trunk_frames(trunk, zero)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        _add_arm(sample, frames, side, sign)
        _add_leg(sample, frames, side)
    return frames | frames_of_feet(sample)


def find_bends(sample: BodySample) -> dict[int, Bend]:
    """Joint (hips or chest) -> the bone above it, which may point elsewhere than the joint's frame says.

    A joint whose bone is shorter than SHORT is left out.
    """
    body, out = sample.body, {}
    above_chest = () if body.arms_on_neck else (*body.neck, body.head)
    for joint, following in ((body.hips, body.trunk), (body.chest, above_chest)):
        if following and sample.length(joint, following[0]) > SHORT:
            bone, axis, left = _trunk_bone(sample, joint)
            out[joint] = Bend(
                following[0], sample.bone(joint, following[0]), rotation_aligning(bone, axis, left, LEFT)
            )
    return out


def trunk_frames(sample: BodySample, zero: Array | None) -> dict[int, Array]:
    """Joint -> its frame (4,), only for the hips, trunk, neck and head.

    sample: moments that show how these joints are turned. zero: as for `frames_from_motion`.
    """
    body, frames = sample.body, dict[int, Array]()
    chain = (body.hips, *body.trunk, *body.neck)
    for joint in chain:
        bone, axis, left = _trunk_bone(sample, joint)
        if body.trunk and joint == body.chest and lacks_neck(sample):
            bone, axis = neck_bone(sample, left, zero), sample.target_proportions.spine.neck_direction
        # `rotation_aligning` fits its first direction exactly and its second one as nearly as possible. For
        # hips and chest, the direction to the left is more reliable than the bone: hips and shoulders are
        # level, but spines of captured rigs bend sideways by some degrees.
        carries_limbs = joint in (body.hips, body.chest)
        frames[joint] = (
            rotation_aligning(left, LEFT, bone, axis)
            if carries_limbs
            else rotation_aligning(bone, axis, left, LEFT)
        )
    frames[body.head] = _head_frame(sample, frames, chain)
    return frames


def _trunk_bone(sample: BodySample, joint: int) -> tuple[Array, Array, Array]:
    """Measure the bone above a joint of trunk or neck. Returns three vectors (3,).

    They are: the bone, in the joint's coordinates; the direction of this bone in a figure that stands facing
    +Z; and the direction to the body's left, in the joint's coordinates.
    """
    body = sample.body
    trunk = (body.hips, *body.trunk)
    chain = (*trunk, *body.neck, body.head)
    lengths = np.array([sample.length(a, b) for a, b in pairwise(chain)])
    # Joint -> its position along the body: 0 at the hips, 1 at the chest, 2 at the head.
    share = dict(zip(chain, spine_shares(lengths, body.trunk_bones), strict=True))
    following = chain[chain.index(joint) + 1 :]
    # A chain of many short bones is not straight. If one bone of the target is as long as several bones of
    # the rig, the direction is measured from the start of the first of these bones to the end of the last.
    within_bone = [
        j for j in following if share[j] <= sample.target_proportions.spine.bone_end(share[joint]) + 1e-6
    ]
    # The chest is stiff up to the shoulders. A very short bone above it does not show how it is turned.
    leg = sample.length(*body.legs["left"][:3])
    least = max(SHORT, KINK * leg) if joint == body.chest else SHORT
    bone, end = sample.first_long_bone(joint, [*within_bone[-1:], *following], least)
    left = sample.chest_left
    if joint == body.hips:
        left = sample.hips_left
    elif joint in trunk and joint != body.chest:
        left = unit_vectors(sample.hips_left + sample.chest_left)
    return (
        bone,
        sample.target_proportions.spine.direction(share[joint], share[end]),
        sample.mean_in_joint_axes(joint, left),
    )


def _head_frame(sample: BodySample, frames: dict[int, Array], chain: Sequence[int]) -> Array:
    """(4,) the frame of the head. chain: the joints from the hips to the last one below the head.

    If all these joints have nearly the same frame as the chest, so has the head. Otherwise the head is
    assumed to look ahead on average.
    """
    chest = frames[sample.body.chest]
    if len(chain) > 2 and max(float(quat.angle(frames[j], chest)) for j in chain) < AGREE:
        return chest
    ahead = unit_vectors(np.cross(sample.chest_left + sample.hips_left, UP) * [1, 0, 1])
    up = sample.mean_in_joint_axes(sample.body.head, np.broadcast_to(UP, ahead.shape))
    return rotation_aligning(up, UP, sample.mean_in_joint_axes(sample.body.head, ahead), AHEAD)


def _add_arm(sample: BodySample, frames: dict[int, Array], side: str, sign: float) -> None:
    """Add the frames of an arm's joints. side, sign: "left" and 1, or "right" and -1.

    In the T-pose, the arm points to sign * LEFT. Its elbow bends forward, about the axis -sign * UP.
    """
    clavicle, shoulder, elbow, wrist = sample.body.arms[side]
    chest = quat.mul(sample.rotations[:, sample.body.chest], frames[sample.body.chest])
    if clavicle is not None:
        frames[clavicle] = mean_rotation(quat.mul(quat.inv(sample.rotations[:, clavicle]), chest))
    hinge = sample.hinge_axes(shoulder, elbow, wrist, -sample.chest_left)
    for start, end in ((shoulder, elbow), (elbow, wrist)):
        frames[start] = rotation_aligning(
            sample.bone(start, end), sign * LEFT, sample.mean_in_joint_axes(start, hinge), -sign * UP
        )
    forearm = quat.mul(sample.rotations[:, elbow], frames[elbow])
    frames[wrist] = sample.hand_frame(
        side, mean_rotation(quat.mul(quat.inv(sample.rotations[:, wrist]), forearm)), sign
    )


def _add_leg(sample: BodySample, frames: dict[int, Array], side: str) -> None:
    """Add the frames of hip and knee. In the T-pose, the leg points down and its knee bends about LEFT."""
    hip, knee, heel, _ = sample.body.legs[side]
    hinge = sample.hinge_axes(hip, knee, heel, sample.hips_left)
    for start, end in ((hip, knee), (knee, heel)):
        frames[start] = rotation_aligning(
            sample.bone(start, end), -UP, sample.mean_in_joint_axes(start, hinge), LEFT
        )
