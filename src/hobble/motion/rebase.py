"""Converts a clip to the joints of its body alone, with rotations relative to a standing rest pose."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations
from hobble.motion.body import SIDES, Body
from hobble.motion.body_sample import LEFT
from hobble.motion.tree import above

MOVES = 0.1  # cm; if the offset of a joint changes by more than this, the clip stores offsets for each frame


def rebased(
    clip: Clip, body: Body, joints: list[int], axes: dict[int, Array], roles: Mapping[str, str]
) -> tuple[Clip, Body]:
    """The clip with only `joints` and a new rest pose, and the body with the new indices of its joints.

    axes: joint -> (4,) rotation of its axes in the new rest pose. roles: role -> name of its joint, for the
    new skeleton.
    """
    skeleton = clip.skeleton
    joints = [
        body.hips,
        *sorted((j for j in joints if j != body.hips), key=lambda j: _depth(skeleton, body, j)),
    ]
    new = {old: i for i, old in enumerate(joints)}
    parents = [-1, *(new[_carrier(skeleton.parents, body, old, new)] for old in joints[1:])]
    turned = quat.mul(clip.global_rotations[:, joints], np.stack([axes[j] for j in joints]))
    for side, finger in body.fingers.items():
        wrist = body.arms[side][3]
        out = quat.rotate(turned[:, new[wrist]], LEFT if side == "left" else -LEFT)
        hand = clip.positions[:, finger] - clip.positions[:, wrist]
        hand = np.where(np.linalg.norm(hand, axis=-1, keepdims=True) > 1e-6, hand, out)
        turned[:, new[wrist]] = quat.mul(quat.between(out, hand), turned[:, new[wrist]])
    places = clip.positions[:, joints]
    from_parent = quat.rotate(quat.inv(turned[:, parents]), places - places[:, parents])
    from_parent[:, 0] = 0.0
    offsets = np.median(from_parent, axis=0)
    moving = np.abs(from_parent - offsets).max() > MOVES
    names = tuple(skeleton.joints[j] for j in joints)
    rebased_skeleton = Skeleton(skeleton.name, names, tuple(parents), offsets, roles=roles)
    rotations = quat.continuous(local_rotations(rebased_skeleton, turned))
    translations = from_parent if moving else None
    rebased_clip = Clip(clip.name, rebased_skeleton, clip.fps, rotations, places[:, 0], translations)
    return rebased_clip, body.renumbered(new)


def _depth(skeleton: Skeleton, body: Body, joint: int) -> int:
    depth = 0
    while joint != body.hips:
        joint = _carrier(skeleton.parents, body, joint, body.joints)
        depth += 1
    return depth


def _carrier(parents: Sequence[int], body: Body, joint: int, among: Collection[int]) -> int:
    """The joint that `joint` hangs from: the one before it in its trunk or limb.

    For a joint that is in neither, it is the nearest of `among` above the joint, or else the hips.
    """
    chain = (body.hips, *body.trunk, *body.neck, body.head)
    if joint in chain:
        return chain[chain.index(joint) - 1]
    for side in SIDES:
        for start, limb in ((body.chest, body.arms[side]), (body.hips, body.legs[side])):
            parts = (start, *(j for j in limb if j is not None))
            if joint in parts[1:]:
                return parts[parts.index(joint) - 1]
    return next((j for j in above(parents, joint)[1:] if j in among), body.hips)
