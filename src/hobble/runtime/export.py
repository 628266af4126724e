"""Write generated motion as clips and BVH files for other tools."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, forward_kinematics, local_rotations, two_bone_knee
from hobble.runtime.feet import leg_joints

FPS = 60.0  # frames a second of the generated motion


def motion_clip(name: str, skeleton: Skeleton, positions: Array, rotations: Array) -> Clip:
    """A clip of world positions (F, J, 3) in cm and world rotations (F, J, 4), in Hobble's axes.

    A clip stores the rotations of all joints, but only the root's position. Predicted rotations do not quite
    lead to the predicted positions. Feet that are off by some millimetres would seem to slide. So the legs
    are bent until the toes are where they were predicted.
    """
    world_rotations, _ = restore_bone_lengths(skeleton, positions, rotations)
    local = quat.continuous(local_rotations(skeleton, world_rotations))
    return Clip(name, skeleton, FPS, local, np.asarray(positions[:, 0], float))


def restore_bone_lengths(skeleton: Skeleton, positions: Array, rotations: Array) -> tuple[Array, Array]:
    """World rotations (F, J, 4) and positions (F, J, 3) of the skeleton in a predicted motion.

    Its bones keep their lengths, while those of a predicted pose change. positions (F, J, 3), rotations
    (F, J, 4): predicted, in the world. The root gets its predicted position, and all joints their predicted
    rotations. Then the legs are bent so that the toes reach their predicted positions.
    """
    local = local_rotations(skeleton, np.asarray(rotations, float))
    world, reached = forward_kinematics(skeleton, local, np.asarray(positions[:, 0], float))
    for leg in leg_joints(skeleton):
        heel, toe = leg[2], leg[3]
        # The foot keeps its rotation, so the heel has to move as far as the toe.
        _bend_leg(world, reached, leg, positions[:, toe] - reached[:, toe] + reached[:, heel])
    local = local_rotations(skeleton, world)
    return forward_kinematics(skeleton, local, np.asarray(positions[:, 0], float))


def _bend_leg(world: Array, positions: Array, leg: Array, target: Array) -> None:
    """Turn thigh and shank so that the heel reaches target (F, 3). The foot's rotation stays.

    world: (F, J, 4) world rotations, changed in place. positions: (F, J, 3) before the turn, not changed.
    leg: hip, knee, heel and toe joint.
    """
    hip, knee, heel = leg[:3]
    thigh, shank = positions[:, knee] - positions[:, hip], positions[:, heel] - positions[:, knee]
    thigh_length, shank_length = (float(np.linalg.norm(bone, axis=-1).mean()) for bone in (thigh, shank))
    new_knee, new_heel = two_bone_knee(positions[:, hip], target, thigh, thigh_length, shank_length)
    world[:, hip] = quat.mul(quat.between(thigh, new_knee - positions[:, hip]), world[:, hip])
    world[:, knee] = quat.mul(quat.between(shank, new_heel - new_knee), world[:, knee])


def fitted_skeleton(skeleton: Skeleton, positions: Array, rotations: Array) -> Skeleton:
    """A copy of the skeleton with the bones of a motion, for networks that were trained on another body.

    Each joint gets its mean offset from its parent in the motion. positions (F, J, 3), rotations (F, J, 4):
    of the motion, in the world.
    """
    offsets = np.zeros((len(skeleton.joints), 3))
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            offset = quat.rotate(quat.inv(rotations[:, p]), positions[:, j] - positions[:, p])
            offsets[j] = offset.mean(axis=0)
    return replace(skeleton, offsets=offsets)


def export_bvh(path: str | Path, name: str, skeleton: Skeleton, positions: Array, rotations: Array) -> None:
    """Write world positions (F, J, 3) and rotations (F, J, 4), Hobble's axes, as a 60 Hz BVH file in cm."""
    write_bvh(path, motion_clip(name, skeleton, positions, rotations))
