"""A character's state between frames: pose, trajectory, phase, targets, channel values, feet."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.models.network import Network

SHOWN = ("knee", "heel", "toe")  # the joints of `leg_shown`


@dataclass
class Character:
    """The state of C characters, changed in place by the controller. World axes, cm, velocities per frame.

    position, direction: (C, T, 2) x and z of the trajectory; gait: (C, T, 6) shares; T frames, of which frame
    T/2 is the present one.
    ground: (C, samples, 3) heights left of, on and right of the path; root_height: (C,) mean height on it.
    joint_position, joint_velocity: (C, J, 3); joint_rotation: (C, J, 4) world: the predicted pose, with
    limited turns of the joints, before feet are placed.
    phase: (C,). channel_values, channel_targets: (C, K) present and target values of all channels' columns.
    smoothed_velocity, smoothed_direction: (C, 2); strafe: (C,); correction: (C, 2): the smoothed target, see
    `Smoothed` in `hobble.runtime.trajectory`.
    foot_lock (C, 2), foot_hold (C, 2, 2), foot_step (C, 2), foot_missed (C, 2): see `Hold` in
    `hobble.runtime.foot_lock`.
    foot_lift (C, 2), foot_added (C, 2, 2, 4), leg_shown (C, 2, 3, 3), body_lift (C,): see `Feet` in
    `hobble.runtime.feet`.
    placed: (C,) whether the joints have been lifted to the ground at the start.
    memory: (C, M) the network's own state of the character, see `Network.memory`.
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
    foot_lock: Array
    foot_hold: Array
    foot_step: Array
    foot_missed: Array
    foot_lift: Array
    foot_added: Array
    leg_shown: Array
    body_lift: Array
    placed: np.ndarray
    memory: Array

    def copies(self, of: np.ndarray) -> Character:
        """A new state whose character i is a copy of character of[i] of this one. of: (C',) indices."""
        return Character(**{field.name: getattr(self, field.name)[of] for field in fields(self)})


class Snapshot:
    """A copy of the state and of the arrays `more`, to restore all of them if a frame fails."""

    def __init__(self, state: Character, *more: Array) -> None:
        arrays = (*(getattr(state, field.name) for field in fields(state)), *more)
        self._arrays = [(array, array.copy()) for array in arrays]

    def restore(self) -> None:
        """Copy the values back into the same arrays."""
        for array, before in self._arrays:
            array[...] = before


def start(network: Network, characters: int, position: Array, yaw: Array) -> Character:
    """C healthy characters at ground positions (C, 2), facing `yaw` (C,) in radians.

    They start in the start frame of the network's file, a standing pose unless the training clips hardly have
    any. If the file has no start frame, they start in the network's mean pose.
    """
    layout, facts = network.layout, network.training_facts
    count = characters
    columns = sum(columns for _, columns in layout.channels)
    now = network.y_mean.astype(float) if facts is None else facts.start_y.astype(float)
    path, heading, gait = _start_path(network)
    sin, cos = np.sin(yaw)[:, None], np.cos(yaw)[:, None]
    joints = now[layout.y_joint_position].reshape(-1, 3)
    in_world = _turned(joints, sin, cos)
    in_world[..., ::2] += position[:, None]
    assert network.skeleton is not None
    legs = [[network.skeleton.role(f"{side}_{part}") for part in SHOWN] for side in ("left", "right")]
    moving = np.zeros_like(joints) if facts is None else now[layout.y_joint_velocity].reshape(-1, 3)
    turns = now[layout.y_joint_rotation].reshape(-1, 3)
    facing = np.concatenate([sin, cos], axis=1)
    return Character(
        position=_turned(path, sin, cos) + position[:, None],
        direction=_turned(heading, sin, cos),
        gait=np.repeat(gait[None], count, axis=0),
        ground=np.zeros((count, layout.samples, 3)),
        root_height=np.zeros(count),
        joint_position=np.ascontiguousarray(in_world),
        joint_velocity=np.ascontiguousarray(_turned(moving, sin, cos)),
        joint_rotation=quat.mul(quat.yaw(yaw)[:, None], quat.exp(turns)),
        phase=np.full(count, 0.0 if facts is None else facts.start_phase),
        channel_values=np.zeros((count, columns)),
        channel_targets=np.zeros((count, columns)),
        smoothed_velocity=np.zeros((count, 2)),
        smoothed_direction=facing.copy(),
        strafe=np.zeros(count),
        correction=np.zeros((count, 2)),
        foot_lock=np.zeros((count, 2)),
        foot_hold=np.zeros((count, 2, 2)),
        foot_step=np.zeros((count, 2)),
        foot_missed=np.zeros((count, 2)),
        foot_lift=np.zeros((count, 2)),
        foot_added=np.tile([1.0, 0.0, 0.0, 0.0], (count, 2, 2, 1)),
        leg_shown=in_world[:, legs].copy(),
        body_lift=np.zeros(count),
        placed=np.zeros(count, bool),
        memory=np.zeros((count, network.memory)),
    )


def _start_path(network: Network) -> tuple[Array, Array, Array]:
    """Path (T, 2), facing (T, 2) and gait (T, 6) around the start frame, relative to its root.

    If the file has no start frame, the character stands still.
    """
    layout, facts = network.layout, network.training_facts
    length = 2 * layout.window
    if facts is None:
        gait = np.zeros((length, len(network.gaits)))
        gait[:, network.gaits.index("stand")] = 1.0
        return np.zeros((length, 2)), np.tile([0.0, 1.0], (length, 1)), gait
    frames, samples = np.arange(-layout.window, layout.window), np.array(layout.offsets)

    def through(block: slice) -> Array:
        rows = facts.start_x[block].astype(float).reshape(-1, layout.samples)
        return np.stack([np.interp(frames, samples, row) for row in rows], axis=1)

    facing = through(layout.x_direction)
    facing /= np.maximum(np.linalg.norm(facing, axis=1, keepdims=True), 1e-6)
    return through(layout.x_position), facing, through(layout.x_gait)


def _turned(vectors: Array, sin: Array, cos: Array) -> Array:
    """Vectors (N, 2 or 3) turned about Y by C angles: (C, N, 2 or 3). sin, cos: (C, 1)."""
    x, z = vectors[:, 0], vectors[:, -1]
    parts = [
        x * cos + z * sin,
        *(np.broadcast_to(v, (len(sin), len(x))) for v in vectors.T[1:-1]),
        z * cos - x * sin,
    ]
    return np.stack(parts, axis=-1)
