"""Captured motion for the measurements: stretches of consecutive frames of a clip, in root coordinates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.rows.clip_rows import ClipRows
from hobble.rows.layout import GAITS, lower_joints


@dataclass(frozen=True)
class Captured:
    """F consecutive frames of a clip.

    clip: its name. local: (F, J, 3) joint positions in root coordinates, heights above the ground, cm.
    contacts: (F, 4) 1 for contact with the ground, else 0, of left heel, left toe, right heel, right toe.
    phase: (F,) from 0 to 1. channels: name -> values (F, columns). gait: (F, 6) share of each of the GAITS.
    velocity: (F, 2) of the root in root coordinates, cm per frame. root: (F, 3) position of the root on the
    ground, cm. The first is the origin. acceleration: (F,) the largest of any joint, cm per frame squared, 0
    in the first frame. rows: (F,) index of each frame's row among the rows of the clip.
    """

    clip: str
    local: Array = field(repr=False)
    contacts: Array = field(repr=False)
    phase: Array = field(repr=False)
    channels: Mapping[str, Array] = field(repr=False)
    gait: Array = field(repr=False)
    velocity: Array = field(repr=False)
    root: Array = field(repr=False)
    acceleration: Array = field(repr=False)
    rows: np.ndarray = field(repr=False)

    def __len__(self) -> int:
        return len(self.phase)


def unbroken_stretches(frame: np.ndarray) -> list[np.ndarray]:
    """For each stretch of consecutive frames, the indices of its rows. frame: (R,) frame of each row.

    A frame on the border of two gait cycles has two rows, one in each cycle. Only the first of them is taken.

    >>> [stretch.tolist() for stretch in unbroken_stretches(np.array([3, 4, 7, 8, 8, 9]))]
    [[0, 1], [2, 3, 5]]
    """
    if not len(frame):
        return []
    _, first = np.unique(frame, return_index=True)
    return np.split(first, np.flatnonzero(np.diff(frame[first]) != 1) + 1)


def captured_stretches(rows: ClipRows) -> Iterator[Captured]:
    """Each stretch of consecutive frames in a clip's rows.

    A row has several terrain fits (ground heights that suit the motion). Joint heights are measured from the
    mean ground height of its first fit.
    """
    layout = rows.layout
    for chosen in unbroken_stretches(rows.frame):  # indices of rows
        y = rows.y[chosen].astype(float)
        lower_joints(y, layout.y_joint_position, rows.mean[rows.first_fit[chosen]][:, None])
        local = y[:, layout.y_joint_position].reshape(len(chosen), -1, 3)
        turn, velocity = y[:, layout.y_turn][:, 0], y[:, layout.y_root_velocity]
        gait = rows.x[chosen][:, layout.x_gait].reshape(len(chosen), len(GAITS), layout.samples)
        yield Captured(
            rows.clip,
            local,
            y[:, layout.y_contacts],
            rows.p[chosen].astype(float),
            {name: values[chosen].astype(float) for name, values in rows.channels.items()},
            gait[:, :, layout.samples // 2].astype(float),
            velocity,
            root_path(velocity, turn),
            _accelerations(y[:, layout.y_joint_velocity].reshape(local.shape), turn),
            chosen,
        )


def headings(turn: Array) -> Array:
    """(F,) yaw of a root in radians. It starts at 0.

    turn: (F,) column `y_turn` of Y, radians a frame: by how much the world turns, seen from the root. The
    root itself turns by the negative.
    """
    return np.concatenate([[0.0], -np.cumsum(turn)[:-1]])


def root_path(velocity: Array, turn: Array) -> Array:
    """(F, 3) positions of a root, cm. The path starts at the origin, and its height is 0.

    velocity: (F, 2) of the root in root coordinates, cm per frame. turn: (F,) as for `headings`.
    """
    world_velocity = rotate_by_yaw(velocity, headings(turn))
    out = np.zeros((len(turn), 3))
    out[1:, ::2] = np.cumsum(world_velocity, axis=0)[:-1]
    return out


def rotate_by_yaw(vectors: Array, yaw: Array) -> Array:
    """Rotate horizontal vectors x, z (..., 2) from root coordinates to the world. yaw: (...) of the root."""
    sin, cos = np.sin(yaw), np.cos(yaw)
    x, z = vectors[..., 0], vectors[..., 1]
    return np.stack([x * cos + z * sin, z * cos - x * sin], axis=-1)


def _accelerations(velocity: Array, turn: Array) -> Array:
    """(F,) largest change of any joint's velocity since the frame before, cm per frame squared.

    velocity: (F, J, 3) in the root coordinates of each frame. turn: (F,) as for `headings`.
    """
    before = velocity[:-1].copy()  # becomes each frame's velocity in the root coordinates of the next frame
    before[..., ::2] = rotate_by_yaw(velocity[:-1, :, ::2], turn[:-1, None])
    change = np.linalg.norm(velocity[1:] - before, axis=-1)
    return np.concatenate([[0.0], change.max(axis=1)]) if len(velocity) else np.zeros(0)
