"""Adds joints that a rig lacks: balls of the feet, and second joints at hips and chest to bend the spine.

In many rigs, one joint at the hips carries both legs and the spine, and one joint at the chest carries both
arms and the neck. The rotation of this joint is taken to be that of the limbs, but the bone above the joint
may point in another direction. So a second joint is added at the same place, which follows the bone. The
spine of the target, the skeleton to which the clip will be retargeted, can then follow the second joint.

In this module, the frame of a joint is a rotation (4,) that is the same at all times, not a moment of the
clip. It converts vectors from the axes of a figure that stands facing +Z with its arms out sideways to the
joint's own axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.motion.body import SIDES, Body

# BALL: offset from an ankle to the ball of its foot, as a share of the length of thigh plus shank, for a foot
# that stands and points to +Z. OUTWARD: radians by which feet point outward. Both are means over seven
# subjects of the CMU database. The standard deviations are .006 (height) and .010 (length) for BALL, and 2
# degrees for OUTWARD.
BALL, OUTWARD = np.array([0.0, -0.034, 0.136]), np.radians(5.0)


def with_balls(clip: Clip, body: Body, frames: dict[int, Array]) -> tuple[Clip, Body]:
    """The clip and the body, with a joint at the ball of each foot.

    Missing balls are put where people have them.

    frames: joint -> (4,) frame. This argument is changed: the frames of the new joints are added, and the
    frames of the ankles above them are turned outward.
    """
    sides_without_ball = [side for side in SIDES if body.legs[side][3] is None]
    legs, offsets = dict(body.legs), []
    positions = clip.positions
    for i, side in enumerate(sides_without_ball):
        hip, knee, heel, _ = body.legs[side]
        thigh, shank = (
            float(np.median(np.linalg.norm(positions[:, b] - positions[:, a], axis=-1)))
            for a, b in ((hip, knee), (knee, heel))
        )
        ball = len(clip.skeleton.joints) + i
        outward = quat.yaw(np.array(OUTWARD if side == "left" else -OUTWARD))
        frames[ball] = frames[heel] = quat.mul(frames[heel], outward)
        legs[side] = (hip, knee, heel, ball)
        offsets.append(quat.rotate(frames[heel], BALL * (thigh + shank)))
    heels = [body.legs[side][2] for side in sides_without_ball]
    return _with_joints(clip, "ball", heels, offsets), replace(body, legs=legs)


@dataclass(frozen=True)
class Bend:
    """The bone that leads up from the hips or the chest.

    end: the joint where the bone ends. bone: (3,) mean vector of the bone, in the coordinates of the joint
    where it begins. frame: (4,) the frame of a joint that follows the bone.
    """

    end: int
    bone: Array
    frame: Array


def with_split_joints(
    clip: Clip, body: Body, frames: dict[int, Array], bends: Mapping[int, Bend]
) -> tuple[Clip, Body]:
    """The clip and the body, with second joints at hips and chest.

    frames: joint -> (4,) frame. This argument is changed: the frames of the new joints are added. bends: the
    hips, the chest or both -> the bone above this joint, which the new joint follows. The new joint turns
    only if the bone's end moves relative to the old joint.
    """
    trunk, neck = body.trunk, body.neck
    turns = [_bone_rotations(clip, joint, bend) for joint, bend in bends.items()]
    for new, (joint, bend) in enumerate(bends.items(), len(clip.skeleton.joints)):
        frames[new] = bend.frame
        if joint == body.chest:
            neck = (new, *neck)
        else:
            trunk = (new, *trunk)
    grown = _with_joints(clip, "bend", list(bends), [np.zeros(3)] * len(bends), turns)
    return grown, replace(body, trunk=trunk, neck=neck)


def _bone_rotations(clip: Clip, joint: int, bend: Bend) -> Array:
    """(F, 4) rotations from the mean direction of a bone to its direction in each frame of the clip.

    Directions are relative to `joint`, where the bone begins. Where the bone is shorter than half of its
    mean, its direction is not reliable, and there is no rotation.
    """
    if clip.translations is None:
        return _no_rotations(clip)
    bones = quat.rotate(
        quat.inv(clip.global_rotations[:, joint]), clip.positions[:, bend.end] - clip.positions[:, joint]
    )
    mean = np.broadcast_to(bend.bone, bones.shape)
    long = np.linalg.norm(bones, axis=-1, keepdims=True) > 0.5 * np.linalg.norm(bend.bone)
    return quat.between(mean, np.where(long, bones, mean))


def _no_rotations(clip: Clip) -> Array:
    """(F, 4) identity rotations, one for each frame of the clip."""
    return np.broadcast_to(quat.IDENTITY, (len(clip), 4))


def _with_joints(
    clip: Clip, word: str, parents: Sequence[int], offsets: Sequence[Array], turns: Sequence[Array] = ()
) -> Clip:
    """The clip with a new joint below each of `parents`, at an offset (3,) from the parent.

    word: last word of the new joints' names. turns: for each new joint, its rotations (F, 4) relative to its
    parent; by default, the new joints do not turn.
    """
    if not parents:
        return clip
    skeleton = clip.skeleton
    names = (*skeleton.joints, *(f"{skeleton.joints[p]}_{word}" for p in parents))
    new_offsets = np.array(offsets)
    new_rotations = np.stack(turns or [_no_rotations(clip)] * len(parents), axis=1)
    translations = clip.translations
    if translations is not None:
        new_translations = np.broadcast_to(new_offsets, (len(clip), *new_offsets.shape))
        translations = np.concatenate([translations, new_translations], axis=1)
    grown = replace(
        skeleton,
        joints=names,
        parents=(*skeleton.parents, *parents),
        offsets=np.concatenate([skeleton.offsets, new_offsets]),
    )
    rotations = np.concatenate([clip.rotations, new_rotations], axis=1)
    return replace(clip, skeleton=grown, rotations=rotations, translations=translations)
