"""Generated motion as clips and BVH files that other tools open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, local_rotations

FPS = 60.0


def motion_clip(name: str, skeleton: Skeleton, positions: Array, rotations: Array) -> Clip:
    """A clip of world positions (F, J, 3) in cm and world rotations (F, J, 4) in our axes.

    The root is placed at its position, every other joint by its rotation and the skeleton's bones.
    """
    local = quat.continuous(local_rotations(skeleton, rotations))
    return Clip(name, skeleton, FPS, local, np.asarray(positions[:, 0], float))


def fitted_skeleton(skeleton: Skeleton, positions: Array, rotations: Array) -> Skeleton:
    """The skeleton with the bones that a motion has: mean position of each joint in its parent's frame.

    For networks that were trained on another body than `skeleton` describes.
    """
    offsets = np.zeros((len(skeleton.joints), 3))
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            bone = quat.rotate(quat.inv(rotations[:, p]), positions[:, j] - positions[:, p])
            offsets[j] = bone.mean(axis=0)
    return replace(skeleton, offsets=offsets)


def export_bvh(path: str | Path, name: str, skeleton: Skeleton, positions: Array, rotations: Array) -> None:
    """Write world positions (F, J, 3) and rotations (F, J, 4), our axes, as a 60 Hz BVH file in
    centimetres."""
    write_bvh(path, motion_clip(name, skeleton, positions, rotations))


def track_arrays(poses: Sequence) -> tuple[Array, Array]:
    """Positions (F, J, 3) and rotations (F, J, 4) of successive poses of one character."""
    return np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
