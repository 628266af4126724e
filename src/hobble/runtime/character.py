"""What a character is between two frames: pose, trajectory, phase, wishes, what it is told, feet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.models.network import Network


@dataclass
class Character:
    """The state of C characters, changed in place by the controller. World axes, cm, velocities per frame.

    position, direction: (C, T, 2) trajectory; gait: (C, T, 6). ground: (C, samples, 3) heights at left, path,
    right; root_height: (C,) mean of those on the path. joint_position, joint_velocity: (C, J, 3);
    joint_rotation: (C, J, 4) world: the network's own copy. phase: (C,). told, told_target: (C, K) every
    channel's columns side by side.
    target_velocity, target_direction: (C, 2); strafe: (C,); owed: (C, 2) of `trajectory.follow_wish`.
    foot_lock (C, 2), foot_hold (C, 2, 2), foot_lift (C, 2), foot_added (C, 2, 2, 4): of `feet`.
    """

    position: Array
    direction: Array
    gait: Array
    ground: Array
    root_height: Array
    joint_position: Array
    joint_velocity: Array
    joint_rotation: Array
    phase: Array
    told: Array
    told_target: Array
    target_velocity: Array
    target_direction: Array
    strafe: Array
    owed: Array
    foot_lock: Array
    foot_hold: Array
    foot_lift: Array
    foot_added: Array


def standing(network: Network, characters: int, position: Array, yaw: Array) -> Character:
    """C characters in the network's mean pose at ground positions (C, 2), facing `yaw` (C,) in radians."""
    layout = network.layout
    count, joints, length = characters, layout.joints, 2 * layout.window
    columns = sum(columns for _, columns in layout.channels)
    mean = network.y_mean.astype(float)
    sin, cos = np.sin(yaw)[:, None], np.cos(yaw)[:, None]
    x, y, z = mean[layout.y_joint_position].reshape(joints, 3).T
    turns = mean[layout.y_joint_rotation].reshape(joints, 3)
    placed = np.stack(
        [
            x * cos + z * sin + position[:, :1],
            np.broadcast_to(y, (count, joints)),
            z * cos - x * sin + position[:, 1:],
        ],
        axis=-1,
    )
    gait = np.zeros((count, length, len(network.gaits)))
    gait[..., network.gaits.index("stand")] = 1.0
    facing = np.concatenate([sin, cos], axis=1)
    return Character(
        position=np.repeat(position[:, None], length, axis=1).astype(float),
        direction=np.repeat(facing[:, None], length, axis=1),
        gait=gait,
        ground=np.zeros((count, layout.samples, 3)),
        root_height=np.zeros(count),
        joint_position=np.ascontiguousarray(placed),
        joint_velocity=np.zeros((count, joints, 3)),
        joint_rotation=quat.mul(quat.yaw(yaw)[:, None], quat.exp(turns)),
        phase=np.zeros(count),
        told=np.zeros((count, columns)),
        told_target=np.zeros((count, columns)),
        target_velocity=np.zeros((count, 2)),
        target_direction=facing.copy(),
        strafe=np.zeros(count),
        owed=np.zeros((count, 2)),
        foot_lock=np.zeros((count, 2)),
        foot_hold=np.zeros((count, 2, 2)),
        foot_lift=np.zeros((count, 2)),
        foot_added=np.tile([1.0, 0.0, 0.0, 0.0], (count, 2, 2, 1)),
    )
