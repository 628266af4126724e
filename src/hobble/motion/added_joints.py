"""Adds joints that a rig lacks: balls of the feet, and second joints at hips and chest to bend the spine.

In many rigs one joint at the hips carries both legs and spine, and one at the chest both arms and neck. Such
a joint is taken to be turned as its limbs are, but the bone above it may point in another direction. So a
second joint is added at the same place. It follows the bone, and the target's spine can then follow it.

The frame of a joint (not a moment of the clip) is a rotation (4,), the same at all times: from the axes of a
figure that stands facing +Z with its arms out sideways to the joint's own axes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.motion.body import SIDES, Body

# BALL: offset from an ankle to the ball that is added below it, as a share of the length of thigh and shank,
# along the axes of a foot that stands and points to +Z. OUTWARD: radians by which feet point outward. Both
# are means over seven subjects of the CMU database. The standard deviations are .006 (height) and .010
# (length) for BALL, and 2 degrees for OUTWARD.
BALL, OUTWARD = np.array([0.0, -0.034, 0.136]), np.radians(5.0)


def with_balls(clip: Clip, body: Body, frames: dict[int, Array]) -> tuple[Clip, Body]:
    """The clip and the body with a ball on every foot. Missing balls are put where people have them.

    frames: joint -> (4,) frame. This argument is changed: the frames of the new joints are added, and the
    frames of the ankles above them are turned outward.
    """
    without = [side for side in SIDES if body.legs[side][3] is None]
    legs, offsets = dict(body.legs), []
    p = clip.positions
    for i, side in enumerate(without):
        hip, knee, heel, _ = body.legs[side]
        thigh, shank = (
            float(np.median(np.linalg.norm(p[:, b] - p[:, a], axis=-1)))
            for a, b in ((hip, knee), (knee, heel))
        )
        new = len(clip.skeleton.joints) + i
        outward = quat.yaw(np.array(OUTWARD if side == "left" else -OUTWARD))
        frames[new] = frames[heel] = quat.mul(frames[heel], outward)
        legs[side] = (hip, knee, heel, new)
        offsets.append(quat.rotate(frames[heel], BALL * (thigh + shank)))
    heels = [body.legs[side][2] for side in without]
    return _with_joints(clip, "ball", heels, offsets), replace(body, legs=legs)


@dataclass(frozen=True)
class Bend:
    """The bone above hips or chest. end: the joint where it ends. bone: (3,) its mean vector, in the
    coordinates of the joint where it begins. frame: (4,) the frame of a joint that follows the bone.
    """

    end: int
    bone: Array
    frame: Array


def with_split_joints(
    clip: Clip, body: Body, frames: dict[int, Array], bends: Mapping[int, Bend]
) -> tuple[Clip, Body]:
    """The clip and the body with second joints at the places of hips and chest.

    frames: joint -> (4,) frame. This argument is changed: the frames of the new joints are added. bends:
    joint (hips, chest or both) -> the bone above it, which the new joint follows. The new joint turns only if
    the bone's end moves relative to the old joint.
    """
    trunk, neck = body.trunk, body.neck
    turns = [_turns(clip, joint, bend) for joint, bend in bends.items()]
    for new, (joint, bend) in enumerate(bends.items(), len(clip.skeleton.joints)):
        frames[new] = bend.frame
        if joint == body.chest:
            neck = (new, *neck)
        else:
            trunk = (new, *trunk)
    grown = _with_joints(clip, "bend", list(bends), [np.zeros(3)] * len(bends), turns)
    return grown, replace(body, trunk=trunk, neck=neck)


def _turns(clip: Clip, joint: int, bend: Bend) -> Array:
    """(F, 4) rotations of a bone relative to the joint where it begins, from its mean direction.

    The rotation is zero at times at which the bone is shorter than half of its mean.
    """
    if clip.translations is None:
        return _still(clip)
    bones = quat.rotate(
        quat.inv(clip.global_rotations[:, joint]), clip.positions[:, bend.end] - clip.positions[:, joint]
    )
    usual = np.broadcast_to(bend.bone, bones.shape)
    long = np.linalg.norm(bones, axis=-1, keepdims=True) > 0.5 * np.linalg.norm(bend.bone)
    return quat.between(usual, np.where(long, bones, usual))


def _still(clip: Clip) -> Array:
    return np.broadcast_to(quat.IDENTITY, (len(clip), 4))


def _with_joints(
    clip: Clip, word: str, parents: Sequence[int], offsets: Sequence[Array], turns: Sequence[Array] = ()
) -> Clip:
    """The clip with a new joint below each of `parents`, at an offset (3,) from it.

    word: last word of the new joints' names. turns: for each, its rotations (F, 4) relative to its parent; by
    default it does not turn.
    """
    if not parents:
        return clip
    skeleton = clip.skeleton
    names = (*skeleton.joints, *(f"{skeleton.joints[p]}_{word}" for p in parents))
    tail = np.array(offsets)
    new = np.stack(turns or [_still(clip)] * len(parents), axis=1)
    moved = clip.translations
    if moved is not None:
        moved = np.concatenate([moved, np.broadcast_to(tail, (len(clip), *tail.shape))], axis=1)
    grown = replace(
        skeleton,
        joints=names,
        parents=(*skeleton.parents, *parents),
        offsets=np.concatenate([skeleton.offsets, tail]),
    )
    rotations = np.concatenate([clip.rotations, new], axis=1)
    return replace(clip, skeleton=grown, rotations=rotations, translations=moved)
