"""Reduces a clip to the joints of its body, with rotations relative to a standing rest pose."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations
from hobble.motion.body import SIDES, Body
from hobble.motion.body_sample import LEFT
from hobble.motion.tree import path_to_root

# cm: if the offset of a joint from its parent changes by more than this during the clip, the new clip stores
# the offsets of every frame.
MOVES = 0.1


def with_new_rest_pose(
    clip: Clip, body: Body, joints: list[int], axes: dict[int, Array], roles: Mapping[str, str]
) -> tuple[Clip, Body]:
    """The same motion with only `joints` and a new rest pose, and the body with its new joint indices.

    In the new rest pose the figure stands facing +Z with its arms out sideways, and all rotations are zero.
    joints: indices of all joints of the body and of others to keep. axes: joint -> (4,) rotation from the
    axes of this standing figure to the joint's own axes. roles: role -> name of its joint, for the new
    skeleton.
    """
    skeleton = clip.skeleton
    joints = [
        body.hips,
        *sorted((j for j in joints if j != body.hips), key=lambda j: _depth(skeleton, body, j)),
    ]
    new = {old: i for i, old in enumerate(joints)}  # old index of a joint -> new index
    parents = [-1, *(new[_new_parent(skeleton.parents, body, old, new)] for old in joints[1:])]
    # How far each body part has turned, in the world, from the new rest pose.
    turned = quat.mul(clip.global_rotations[:, joints], np.stack([axes[j] for j in joints]))
    # A hand with a finger points to it in every frame.
    for side, finger in body.fingers.items():
        wrist = body.arms[side][3]
        pointing = quat.rotate(turned[:, new[wrist]], LEFT if side == "left" else -LEFT)
        to_finger = clip.positions[:, finger] - clip.positions[:, wrist]
        has_length = np.linalg.norm(to_finger, axis=-1, keepdims=True) > 1e-6
        to_finger = np.where(has_length, to_finger, pointing)
        turned[:, new[wrist]] = quat.mul(quat.between(pointing, to_finger), turned[:, new[wrist]])
    places = clip.positions[:, joints]
    from_parent = quat.rotate(quat.inv(turned[:, parents]), places - places[:, parents])
    from_parent[:, 0] = 0.0  # the hips have no parent
    offsets = np.median(from_parent, axis=0)
    moving = np.abs(from_parent - offsets).max() > MOVES
    names = tuple(skeleton.joints[j] for j in joints)
    new_skeleton = Skeleton(skeleton.name, names, tuple(parents), offsets, roles=roles)
    rotations = quat.continuous(local_rotations(new_skeleton, turned))
    translations = from_parent if moving else None
    new_clip = Clip(clip.name, new_skeleton, clip.fps, rotations, places[:, 0], translations)
    return new_clip, body.renumbered(new)


def _depth(skeleton: Skeleton, body: Body, joint: int) -> int:
    """The number of bones from the hips to a joint on the new skeleton."""
    depth = 0
    while joint != body.hips:
        joint = _new_parent(skeleton.parents, body, joint, body.joints)
        depth += 1
    return depth


def _new_parent(parents: Sequence[int], body: Body, joint: int, among: Collection[int]) -> int:
    """The new parent of a joint.

    For a joint of the trunk, neck, head or a limb, it is the joint before it in this chain. For any other
    joint, it is the nearest joint above that is in `among`, or the hips if there is none.
    """
    chain = (body.hips, *body.trunk, *body.neck, body.head)
    if joint in chain:
        return chain[chain.index(joint) - 1]
    for side in SIDES:
        for start, limb in ((body.chest, body.arms[side]), (body.hips, body.legs[side])):
            parts = (start, *(j for j in limb if j is not None))
            if joint in parts[1:]:
                return parts[parts.index(joint) - 1]
    return next((j for j in path_to_root(parents, joint)[1:] if j in among), body.hips)
