"""Write generated motion as clips and BVH files for other tools."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.ik import two_bone_knee
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, forward_kinematics, local_rotations
from hobble.runtime.feet import leg_joints

FPS = 60.0


def motion_clip(name: str, skeleton: Skeleton, positions: Array, rotations: Array) -> Clip:
    """A clip of world positions (F, J, 3) in cm and world rotations (F, J, 4), in Hobble's axes.

    A clip stores the rotations of all joints, but only the root's position. Predicted rotations do not quite
    lead to the predicted positions. Feet that are off by some millimetres would seem to slide, so the legs
    are bent until the toes are where they were predicted.
    """
    world, _ = jointed(skeleton, positions, rotations)
    local = quat.continuous(local_rotations(skeleton, world))
    return Clip(name, skeleton, FPS, local, np.asarray(positions[:, 0], float))


def jointed(skeleton: Skeleton, positions: Array, rotations: Array) -> tuple[Array, Array]:
    """World rotations (F, J, 4) and positions (F, J, 3) of a body with constant bone lengths.

    The root has its predicted position, all other joints their predicted rotations. Then the legs are bent so
    that the toes reach their predicted positions.
    """
    local = local_rotations(skeleton, np.asarray(rotations, float))
    world, reached = forward_kinematics(skeleton, local, np.asarray(positions[:, 0], float))
    for leg in leg_joints(skeleton):
        heel, toe = leg[2], leg[3]
        _reach(world, reached, leg, positions[:, toe] - reached[:, toe] + reached[:, heel])
    local = local_rotations(skeleton, world)
    return forward_kinematics(skeleton, local, np.asarray(positions[:, 0], float))


def _reach(world: Array, positions: Array, leg: Array, target: Array) -> None:
    """Turn thigh and shank in `world` (F, J, 4) so that the heel reaches target (F, 3).

    The foot's rotation stays.
    """
    hip, knee, heel = leg[:3]
    thigh, shank = positions[:, knee] - positions[:, hip], positions[:, heel] - positions[:, knee]
    upper, lower = (float(np.linalg.norm(bone, axis=-1).mean()) for bone in (thigh, shank))
    bent, end = two_bone_knee(positions[:, hip], target, thigh, upper, lower)
    world[:, hip] = quat.mul(quat.between(thigh, bent - positions[:, hip]), world[:, hip])
    world[:, knee] = quat.mul(quat.between(shank, end - bent), world[:, knee])


def fitted_skeleton(skeleton: Skeleton, positions: Array, rotations: Array) -> Skeleton:
    """The skeleton with other bones: each joint's offset is its mean offset from its parent in a motion.

    positions (F, J, 3) and rotations (F, J, 4) of the motion are in the world. For networks that were trained
    on a body other than `skeleton`.
    """
    offsets = np.zeros((len(skeleton.joints), 3))
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            bone = quat.rotate(quat.inv(rotations[:, p]), positions[:, j] - positions[:, p])
            offsets[j] = bone.mean(axis=0)
    return replace(skeleton, offsets=offsets)


def export_bvh(path: str | Path, name: str, skeleton: Skeleton, positions: Array, rotations: Array) -> None:
    """Write world positions (F, J, 3) and rotations (F, J, 4), Hobble's axes, as a 60 Hz BVH file in cm."""
    write_bvh(path, motion_clip(name, skeleton, positions, rotations))
