"""Other animation on top of a character's pose, such as a wave or a look at something.

It changes the caller's copy of the pose. The network goes on from its own. Positions, directions and
rotations are in the caller's axes.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.axes import rest_frame
from hobble.runtime.caller_targets import Axes, Pose

NECK_SHARE = 0.4  # share of a look's turn that the neck takes; the head takes the rest


class Layers:
    """Turns parts of the body of a pose. Every method returns a new pose; `pose` stays as it is.

    skeleton: of the pose's joints. axes: the caller's. A rotation or a direction is one for all C characters,
    or one for each. Raises KeyError for a joint that the skeleton does not have.
    """

    def __init__(self, skeleton: Skeleton, axes: Axes) -> None:
        self.skeleton = skeleton
        # below[j, k]: whether joint k is joint j or moves along with it.
        self._below = np.eye(len(skeleton.joints), dtype=bool)
        for k, p in enumerate(skeleton.parents):
            if p >= 0:
                self._below[:, k] |= self._below[:, p]
        self._ahead = axes.directions_to_caller(quat.rotate(rest_frame(skeleton), [0.0, 0.0, 1.0]))

    def turn(self, pose: Pose, joint: str, rotation: Any) -> Pose:
        """Turn a joint and all joints below it about its place, by a world rotation (4,) or (C, 4)."""
        j = self.skeleton.index(joint)
        below, by = self._below[j], np.asarray(rotation, float)[..., None, :]
        positions, rotations = pose.positions.copy(), pose.rotations.copy()
        at = pose.positions[..., j, None, :]
        positions[..., below, :] = at + quat.rotate(by, pose.positions[..., below, :] - at)
        rotations[..., below, :] = quat.mul(by, pose.rotations[..., below, :])
        return replace(pose, positions=positions, rotations=rotations)

    def aim(self, pose: Pose, joint: str, end: str, direction: Any, weight: float = 1.0) -> Pose:
        """Turn a joint so that the bone to the joint `end` points in a world direction (3,) or (C, 3).

        weight: share of the turn, 0 to 1. A wave aims the upper arm to the side and swings the forearm.
        """
        a, b = self.skeleton.index(joint), self.skeleton.index(end)
        bone = pose.positions[..., b, :] - pose.positions[..., a, :]
        return self.turn(pose, joint, _share(quat.between(bone, np.asarray(direction, float)), weight))

    def look_at(self, pose: Pose, point: Any, weight: float = 1.0, most: float = 70.0) -> Pose:
        """Turn neck and head so that the face points to a world position (3,) or (C, 3).

        weight: share of the turn, 0 to 1. most: largest turn, degrees, before `weight`. Needs the role head.
        """
        head = self.skeleton.role("head")
        ahead = quat.rotate(pose.rotations[..., head, :], self._ahead)
        for role, share in (("neck", NECK_SHARE), ("head", 1.0)):
            if role not in self.skeleton.roles:
                continue
            # Turning the neck moves the head, so the goal is computed for each of them.
            full = quat.between(ahead, np.asarray(point, float) - pose.positions[..., head, :])
            angle = np.maximum(np.degrees(quat.angle(full, quat.IDENTITY)), 1e-9)
            goal = quat.rotate(_share(full, weight * np.minimum(1.0, most / angle)), ahead)
            now = quat.rotate(pose.rotations[..., head, :], self._ahead)
            pose = self.turn(pose, self.skeleton.roles[role], _share(quat.between(now, goal), share))
        return pose

    def play(self, pose: Pose, local: Mapping[str, Any], weight: float = 1.0) -> Pose:
        """Give joints other rotations relative to their parents, such as those of a frame of another clip.

        local: name of a joint -> rotation (4,) or (C, 4), as `hobble.core.skeleton.local_rotations` returns
        them. weight: share of the change, 0 to 1. Joints that are not named follow the joint above them.
        """
        parents = self.skeleton.parents
        for joint in sorted(local, key=self.skeleton.index):  # parents first
            j = self.skeleton.index(joint)
            wanted = np.asarray(local[joint], float)
            if parents[j] >= 0:
                wanted = quat.mul(pose.rotations[..., parents[j], :], wanted)
            change = quat.mul(wanted, quat.inv(pose.rotations[..., j, :]))
            pose = self.turn(pose, joint, _share(change, weight))
        return pose


def _share(rotation: Array, share: Any) -> Array:
    """A share of rotations (..., 4), about the same axis. share: one, or (...)."""
    return quat.slerp(quat.IDENTITY, rotation, share)
