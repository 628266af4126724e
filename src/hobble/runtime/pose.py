"""The pose that a caller gets in each frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hobble.core import quat
from hobble.core.quat import Array


@dataclass(frozen=True)
class Pose:
    """The pose of C characters in one frame. If there is only one character, the arrays have no axis C.

    The caller may keep the pose and change its arrays.
    positions: (C, J, 3) joint positions in the world, in the caller's axes and unit. rotations: (C, J, 4)
    joint rotations in the world, in the caller's axes, as quaternions with w first. contacts: (C, 4)
    predicted contact of left heel, left toe, right heel and right toe, from 0 to 1; 0 while the runtime makes
    the foot step. phase: (C,) in cycles, 0 to 1. root: (C, 3) point on the ground below the hips, in the
    caller's axes and unit. yaw: (C,) direction that the root faces, in radians and always in Hobble's axes: 0
    is +Z, and the angle grows to the left. channels: channel -> values (C, columns) that the network got.
    """

    positions: Array = field(repr=False)
    rotations: Array = field(repr=False)
    contacts: Array
    phase: Any
    root: Array
    yaw: Any
    channels: Mapping[str, Array] = field(repr=False)

    def __getitem__(self, k: int) -> Pose:
        """The pose of character k of several."""
        channels = {name: values[k] for name, values in self.channels.items()}
        return Pose(
            self.positions[k], self.rotations[k], self.contacts[k], float(self.phase[k]), self.root[k],
            float(self.yaw[k]), channels,
        )  # fmt: skip


def world_rotations(turns: Array, yaw: Array) -> Array:
    """(..., J, 4) rotations of joints in the world, from rotations relative to the root.

    turns: (..., J, 3) these rotations, as axis times half the angle. yaw: (...) direction that the root
    faces, radians.
    """
    return quat.mul(quat.yaw(yaw)[..., None, :], quat.exp(turns.astype(float)))
