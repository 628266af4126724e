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

MOVES = 0.1  # cm; a joint whose offset changes by more moves in its parent


def rebased(
    clip: Clip, body: Body, joints: list[int], frames: dict[int, Array], roles: Mapping[str, str]
) -> tuple[Clip, Body]:
    """The clip with only these joints and a new rest pose, and the body with new indices.

    frames: joint -> (4,) the rotation of its axes in the new rest pose. roles: role -> joint, of the new
    skeleton.
    """
    skeleton = clip.skeleton
    joints = [
        body.hips,
        *sorted((j for j in joints if j != body.hips), key=lambda j: _depth(skeleton, body, j)),
    ]
    new = {old: i for i, old in enumerate(joints)}
    parents = [-1, *(new[_carrier(skeleton.parents, body, old, new)] for old in joints[1:])]
    own = np.stack([frames[j] for j in joints])
    turned = quat.mul(clip.global_rotations[:, joints], own)
    for side, finger in body.fingers.items():
        wrist = body.arms[side][3]
        out = quat.rotate(turned[:, new[wrist]], LEFT if side == "left" else -LEFT)
        hand = clip.positions[:, finger] - clip.positions[:, wrist]
        hand = np.where(np.linalg.norm(hand, axis=-1, keepdims=True) > 1e-6, hand, out)
        turned[:, new[wrist]] = quat.mul(quat.between(out, hand), turned[:, new[wrist]])
    places = clip.positions[:, joints]
    arms = quat.rotate(quat.inv(turned[:, parents]), places - places[:, parents])
    arms[:, 0] = 0.0
    offsets = np.median(arms, axis=0)
    moving = np.abs(arms - offsets).max() > MOVES
    moved = body.renumbered(new)
    names = tuple(skeleton.joints[j] for j in joints)
    made = Skeleton(skeleton.name, names, tuple(parents), offsets, roles=roles)
    rotations = quat.continuous(local_rotations(made, turned))
    return Clip(clip.name, made, clip.fps, rotations, places[:, 0], arms if moving else None), moved


def _depth(skeleton: Skeleton, body: Body, joint: int) -> int:
    depth = 0
    while joint != body.hips:
        joint = _carrier(skeleton.parents, body, joint, body.joints)
        depth += 1
    return depth


def _carrier(parents: Sequence[int], body: Body, joint: int, among: Collection[int]) -> int:
    """The joint that `joint` hangs from: the body part before it, or the nearest of `among` above it."""
    chain = (body.hips, *body.trunk, *body.neck, body.head)
    if joint in chain:
        return chain[chain.index(joint) - 1]
    for side in SIDES:
        for start, limb in ((body.chest, body.arms[side]), (body.hips, body.legs[side])):
            parts = (start, *(j for j in limb if j is not None))
            if joint in parts[1:]:
                return parts[parts.index(joint) - 1]
    return next((j for j in above(parents, joint)[1:] if j in among), body.hips)
