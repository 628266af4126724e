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
KINK = 0.06  # leg lengths: a bone above the chest that is shorter than this is skipped
AGREE = np.radians(25.0)  # two joints of the trunk count as turned alike if their frames differ by less


def from_motion(sample: BodySample, trunk: BodySample, zero: Array | None) -> dict[int, Array]:
    """Joint -> (4,) frame, from the directions of the bones in motion.

    The frame of a joint is the rotation from the axes of a standing figure to the joint's own axes
    (`BodySample` in `hobble.motion.body_sample` explains it). trunk: the moments that show how the trunk is
    turned. zero: (4,) frame of the chest in the zero pose, for rigs without a neck; None if nobody could
    stand in that pose.
    """
    frames = trunk_frames(trunk, zero)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        _arm(sample, frames, side, sign)
        _leg(sample, frames, side)
    return frames | flat_feet(sample)


def bends(sample: BodySample) -> dict[int, Bend]:
    """Joint (hips, chest) -> the bone above it. A joint whose bone is shorter than SHORT is left out."""
    body, out = sample.body, {}
    above_chest = () if body.arms_on_neck else (*body.neck, body.head)
    for joint, following in ((body.hips, body.trunk), (body.chest, above_chest)):
        if following and sample.length(joint, following[0]) > SHORT:
            bone, axis, left = _bone(sample, joint)
            out[joint] = Bend(following[0], sample.bone(joint, following[0]), frame(bone, axis, left, LEFT))
    return out


def trunk_frames(sample: BodySample, zero: Array | None) -> dict[int, Array]:
    """The frames of hips, trunk, neck and head alone.

    sample: the moments that show how these are turned. zero: as for `from_motion`.
    """
    body, frames = sample.body, dict[int, Array]()
    chain = (body.hips, *body.trunk, *body.neck)
    for joint in chain:
        bone, axis, left = _bone(sample, joint)
        if body.trunk and joint == body.chest and lacks_neck(sample):
            bone, axis = neck_bone(sample, left, zero), sample.target.spine.neck_direction
        # For hips and chest, the direction to the left is more reliable than the bone: hips and shoulders are
        # level, but spines of captured rigs bend sideways by some degrees.
        carries_limbs = joint in (body.hips, body.chest)
        frames[joint] = frame(left, LEFT, bone, axis) if carries_limbs else frame(bone, axis, left, LEFT)
    frames[body.head] = _head(sample, frames, chain)
    return frames


def _bone(sample: BodySample, joint: int) -> tuple[Array, Array, Array]:
    """Three vectors (3,): the bone above a joint of trunk or neck, this bone's direction in a standing rest
    pose, and the direction to the body's left.

    The bone and the direction to the left are in the joint's coordinates.
    """
    body = sample.body
    trunk = (body.hips, *body.trunk)
    chain = (*trunk, *body.neck, body.head)
    lengths = np.array([sample.length(a, b) for a, b in pairwise(chain)])
    share = dict(zip(chain, spine_shares(lengths, body.trunk_bones), strict=True))
    following = chain[chain.index(joint) + 1 :]
    # A rig with many short bones has kinks. Where one bone of the target is as long as several bones of the
    # rig, the direction is measured from the beginning of the first of these to the end of the last.
    reach = [j for j in following if share[j] <= sample.target.spine.bone_end(share[joint]) + 1e-6]
    # The chest is stiff up to the shoulders. A very short bone above it does not show how the
    # chest is turned.
    leg = sample.length(*body.legs["left"][:3])
    least = max(SHORT, KINK * leg) if joint == body.chest else SHORT
    bone, end = sample.first_long(joint, [*reach[-1:], *following], least)
    left = sample.chest_left
    if joint == body.hips:
        left = sample.hips_left
    elif joint in trunk and joint != body.chest:
        left = unit(sample.hips_left + sample.chest_left)
    return bone, sample.target.spine.direction(share[joint], share[end]), sample.local(joint, left)


def _head(sample: BodySample, frames: dict[int, Array], chain: Sequence[int]) -> Array:
    """(4,) the frame of the head.

    If all joints of trunk and neck have nearly the same frame as the chest, the head gets the chest's frame.
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
