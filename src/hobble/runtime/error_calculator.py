"""Steps a character through recorded rows, frame by frame, as the ErrorCalculator of Segerstedt (2021)."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from hobble.core.quat import Array
from hobble.rows.clip_rows import (
    ClipRows,
    compose_pairs,
    headings,
    root_path,
    rotate_by_yaw,
    unbroken_stretches,
)
from hobble.runtime.caller_targets import Pose, world_rotations

# cm: a joint nearer than this to the root counts as this far from it, so that nothing is divided by 0.
LEAST_DISTANCE = 1e-3


def relative_and_distance(truth: Array, predicted: Array) -> Array:
    """(..., 2): relative error, and distance in cm, of predicted joint positions.

    truth, predicted: (..., 3) captured and predicted positions relative to the root, cm.
    """
    distance = np.linalg.norm(truth - predicted, axis=-1)
    from_root = np.maximum(np.linalg.norm(truth, axis=-1), LEAST_DISTANCE)
    return np.stack([distance / from_root, distance], axis=-1)


@dataclass(frozen=True)
class Compared:
    """A frame, or F frames: then each array has a leading axis F, and iterating gives the frames.

    frame: its number in the clip. truth, predicted: the captured pose, and the one that the network predicts
    from the captured input of the frame before. Both are placed at the captured root, in the caller's axes
    and unit. relative, distance: (J,) error of each joint: the distance from truth to prediction as a share
    of the joint's distance from the root, and in cm.
    """

    frame: Any
    truth: Pose
    predicted: Pose
    relative: Array = field(repr=False)
    distance: Array = field(repr=False)

    def __len__(self) -> int:
        return len(self.frame)

    def __getitem__(self, k: int) -> Self:
        pose = self.truth[k], self.predicted[k]
        return type(self)(int(self.frame[k]), *pose, self.relative[k], self.distance[k])

    def __iter__(self) -> Iterator[Self]:
        return (self[k] for k in range(len(self)))


def compare(character: Any, rows: ClipRows) -> Compared:
    """All frames of `rows`, compared; see `ProceduralAnimation.compare`.

    A frame on the border of two gait cycles has two rows, of which the first is used, with the first of its
    terrain fits.
    """
    network, layout = character.network, character.network.layout
    if not rows.layout.serves(layout):
        raise ValueError(f"the rows ({rows.layout}) are not those that the network has learnt ({layout})")
    stretches = unbroken_stretches(rows.frame)
    chosen = np.concatenate([np.zeros(0, np.int64), *stretches])
    pairs = compose_pairs(rows, layout, chosen, rows.first_fit[chosen])
    # A network with a memory would continue from the prediction before. Here each frame is on its own.
    predict = network.predict if network.memory_size else character.predictor.predict
    predicted = predict(pairs.x, pairs.p.astype(float))
    moves = [rows.y[stretch].astype(float) for stretch in stretches]
    turns = [y[:, layout.y_turn][:, 0] for y in moves]
    paths = (root_path(y[:, layout.y_root_velocity], turn) for y, turn in zip(moves, turns, strict=True))
    root, yaw = np.concatenate([np.zeros((0, 3)), *paths]), np.concatenate([[], *map(headings, turns)])
    root[:, 1] = rows.mean[rows.first_fit[chosen]]
    values = {name: rows.channels[name][chosen] for name in network.channels}

    def pose(y: Array) -> Pose:
        world = local_positions(y)
        world[..., ::2] = rotate_by_yaw(world[..., ::2], yaw[:, None])
        turned = world_rotations(y[:, layout.y_joint_rotation].reshape(len(y), -1, 3), yaw)
        contacts = np.clip(y[:, layout.y_contacts], 0, 1)
        placed = world + root[:, None], turned
        return character.pose_in_callers_axes(*placed, contacts, pairs.p, root, yaw, values)

    def local_positions(y: Array) -> Array:
        return y[:, layout.y_joint_position].reshape(len(y), -1, 3).astype(float)

    errors = relative_and_distance(local_positions(pairs.y), local_positions(predicted))
    return Compared(rows.frame[chosen], pose(pairs.y), pose(predicted), errors[..., 0], errors[..., 1])
