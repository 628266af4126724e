"""Adds joints that a rig lacks: balls of the feet, and bends of the spine at hips and chest.

Hips and chest are turned by the limbs that they carry, and the spine by its bones. A rig on which one joint
does both gets a second joint at the same place, so that the target's spine can follow the bones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.motion.body import SIDES, Body

# Offset from an ankle to the ball that is added below it, as a share of the length of thigh and shank, along
# the axes of a body that stands upright and faces +Z.
BALL = np.array([0.0, -0.045, 0.14])


def with_balls(clip: Clip, body: Body, frames: dict[int, Array]) -> tuple[Clip, Body]:
    """The clip and the body with a ball on every foot. Missing balls are put where people have them.

    frames: joint -> (4,) frame, as `BodySample` defines it. Those of the new joints are added to it.
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
        frames[new] = frames[heel]
        legs[side] = (hip, knee, heel, new)
        offsets.append(quat.rotate(frames[heel], BALL * (thigh + shank)))
    heels = [body.legs[side][2] for side in without]
    return _with_joints(clip, "ball", heels, offsets), replace(body, legs=legs)


def with_split_joints(
    clip: Clip, body: Body, frames: dict[int, Array], bends: Mapping[int, Array]
) -> tuple[Clip, Body]:
    """The clip and the body with further joints at the places of hips and chest.

    frames: joint -> (4,) frame, as `BodySample` defines it. Those of the new joints are added to it. bends:
    hips or chest, or both -> (4,) frame of the bone above that joint, which the new joint gets.
    """
    trunk, neck = body.trunk, body.neck
    for new, (joint, turn) in enumerate(bends.items(), len(clip.skeleton.joints)):
        frames[new] = turn
        if joint == body.chest:
            neck = (new, *neck)
        else:
            trunk = (new, *trunk)
    return _with_joints(clip, "bend", list(bends), [np.zeros(3)] * len(bends)), replace(
        body, trunk=trunk, neck=neck
    )


def _with_joints(clip: Clip, word: str, parents: Sequence[int], offsets: Sequence[Array]) -> Clip:
    """The clip with a new joint below each of `parents`, at an offset (3,) from it. The new joints never move
    relative to their parents. word: end of their names.
    """
    if not parents:
        return clip
    skeleton = clip.skeleton
    names = (*skeleton.joints, *(f"{skeleton.joints[p]}_{word}" for p in parents))
    tail = np.array(offsets)
    still = np.broadcast_to(quat.IDENTITY, (len(clip), len(parents), 4))
    moved = clip.translations
    if moved is not None:
        moved = np.concatenate([moved, np.broadcast_to(tail, (len(clip), *tail.shape))], axis=1)
    grown = replace(
        skeleton,
        joints=names,
        parents=(*skeleton.parents, *parents),
        offsets=np.concatenate([skeleton.offsets, tail]),
    )
    rotations = np.concatenate([clip.rotations, still], axis=1)
    return replace(clip, skeleton=grown, rotations=rotations, translations=moved)
