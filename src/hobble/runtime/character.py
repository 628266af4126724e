"""A character's state between frames: pose, trajectory, phase, targets, channel values, feet.

A channel is a group of network inputs that tell how hurt or how sad the body is. A healthy character
starts with the defaults of all channels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hobble.channels import channel
from hobble.core import quat
from hobble.core.quat import Array
from hobble.models.network import Network

# Arrays of the state that start at 0 -> their shape for one character.
AT_ZERO: dict[str, tuple[int, ...]] = {
    "root_height": (), "smoothed_velocity": (2,), "strafe": (), "correction": (2,), "earlier": (2,),
    "foot_lock": (2,), "foot_hold": (2, 2), "foot_step": (2,), "foot_missed": (2,), "foot_lift": (2,),
    "body_lift": (), "hips_sink": (), "step": (), "knee_more": (2,), "arm_more": (2,), "arm_mean": (2,),
}  # fmt: skip
SHOWN_JOINTS = ("knee", "heel", "toe")  # the joints of each leg in `Character.leg_shown`, in this order


@dataclass
class Character:
    """The state of C characters, changed in place by the controller. World axes, cm, velocities per frame.

    position, direction: (C, T, 2) x and z of the trajectory and of the facing along it. gait: (C, T, 6)
    shares of the gaits. The trajectory has T frames, and frame T/2 is the present one.
    ground: (C, samples, 3) ground heights left of the path, on it and right of it. root_height: (C,) mean
    ground height on the path.
    joint_position, joint_velocity (C, J, 3), joint_rotation (C, J, 4), in the world: the pose before foot
    placement. Joints follow the prediction, but move and turn by a limited amount in a frame.
    phase: (C,) cycles, 0 to 1. channel_values, channel_targets: (C, K) present and target values of the K
    columns of all channels.
    smoothed_velocity, smoothed_direction (C, 2), strafe (C,), correction, earlier (C, 2): the smoothed
    target, see `Smoothed` in `hobble.runtime.trajectory`.
    foot_lock (C, 2), foot_hold (C, 2, 2), foot_step (C, 2), foot_missed (C, 2): where and how firmly feet are
    held, see `Hold` in `hobble.runtime.feet`.
    foot_lift (C, 2), foot_added (C, 2, 2, 4), leg_shown (C, 2, 3, 3), body_lift, hips_sink (C,): the rest
    of foot placement, see `Feet` and `carry_body` in `hobble.runtime.feet`.
    placed: (C,) bool, whether the joints have been lifted to the ground, which happens once, at the start.
    step (C,), half cycles since the start, knee_more, arm_more, arm_mean (C, 2): what differs from step to
    step, see `hobble.runtime.variation`.
    memory: (C, M) the network's own state of the character, see `Network.memory_size`.
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
    channel_values: Array
    channel_targets: Array
    smoothed_velocity: Array
    smoothed_direction: Array
    strafe: Array
    correction: Array
    earlier: Array
    foot_lock: Array
    foot_hold: Array
    foot_step: Array
    foot_missed: Array
    foot_lift: Array
    foot_added: Array
    leg_shown: Array
    body_lift: Array
    hips_sink: Array
    placed: np.ndarray
    step: Array
    knee_more: Array
    arm_more: Array
    arm_mean: Array
    memory: Array


def start_characters(
    network: Network, count: int, position: Array, yaw: Array, scales: Mapping[str, float]
) -> Character:
    """The states of `count` healthy characters at ground positions (C, 2), facing `yaw` (C,) in radians.

    scales: channel -> number by which its values are divided, 1 for others.

    They start in the start frame of the network's file. It is a standing pose, unless the training clips
    hardly have any. If the file has no start frame, they start in the network's mean pose.
    """
    layout, facts = network.layout, network.training_facts
    sizes = layout.channels
    at_rest = [channel(name).default / scales.get(name, 1.0) for name, n in sizes for _ in range(n)]
    # A row of network outputs, relative to the root.
    start_row = network.y_mean.astype(float) if facts is None else facts.start_y.astype(float)
    path, path_direction, gait = _start_path(network)
    sin, cos = np.sin(yaw)[:, None], np.cos(yaw)[:, None]
    joints = start_row[layout.y_joint_position].reshape(-1, 3)
    in_world = _turn_about_y(joints, sin, cos)
    in_world[..., ::2] += position[:, None]
    assert network.skeleton is not None
    legs = [[network.skeleton.role(f"{side}_{part}") for part in SHOWN_JOINTS] for side in ("left", "right")]
    velocity = np.zeros_like(joints) if facts is None else start_row[layout.y_joint_velocity].reshape(-1, 3)
    half_turns = start_row[layout.y_joint_rotation].reshape(-1, 3)  # axis times half the angle
    facing = np.concatenate([sin, cos], axis=1)
    return Character(
        position=_turn_about_y(path, sin, cos) + position[:, None],
        direction=_turn_about_y(path_direction, sin, cos),
        gait=np.repeat(gait[None], count, axis=0),
        ground=np.zeros((count, layout.samples, 3)),
        joint_position=np.ascontiguousarray(in_world),
        joint_velocity=np.ascontiguousarray(_turn_about_y(velocity, sin, cos)),
        joint_rotation=quat.mul(quat.yaw(yaw)[:, None], quat.exp(half_turns)),
        phase=np.full(count, 0.0 if facts is None else facts.start_phase),
        channel_values=np.tile(at_rest, (count, 1)),
        channel_targets=np.tile(at_rest, (count, 1)),
        smoothed_direction=facing.copy(),
        foot_added=np.tile([1.0, 0.0, 0.0, 0.0], (count, 2, 2, 1)),
        leg_shown=in_world[:, legs].copy(),
        placed=np.zeros(count, bool),
        memory=np.zeros((count, network.memory_size)),
        **{name: np.zeros((count, *shape)) for name, shape in AT_ZERO.items()},
    )


def _start_path(network: Network) -> tuple[Array, Array, Array]:
    """Path (T, 2), facing (T, 2) and gait shares (T, 6) around the start frame, relative to its root.

    If the network's file has no start frame, these are the values of a character that stands still.
    """
    layout, facts = network.layout, network.training_facts
    length = 2 * layout.window
    if facts is None:
        gait = np.zeros((length, len(network.gaits)))
        gait[:, network.gaits.index("stand")] = 1.0
        return np.zeros((length, 2)), np.tile([0.0, 1.0], (length, 1)), gait
    frames, samples = np.arange(-layout.window, layout.window), np.array(layout.offsets)

    def in_each_frame(block: slice) -> Array:
        """(T, n) the n values of a block of the start row in each frame, interpolated between its samples."""
        rows = facts.start_x[block].astype(float).reshape(-1, layout.samples)
        return np.stack([np.interp(frames, samples, row) for row in rows], axis=1)

    facing = in_each_frame(layout.x_direction)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-6)
    return in_each_frame(layout.x_position), facing, in_each_frame(layout.x_gait)


def _turn_about_y(vectors: Array, sin: Array, cos: Array) -> Array:
    """(C, N, 2 or 3) the N vectors turned about Y by each of C angles.

    vectors: (N, 2) x and z, or (N, 3) x, y and z. sin, cos: (C, 1) of the angles.
    """
    x, z = vectors[:, 0], vectors[:, -1]
    heights = (np.broadcast_to(y, (len(sin), len(x))) for y in vectors.T[1:-1])
    return np.stack([x * cos + z * sin, *heights, z * cos - x * sin], axis=-1)
