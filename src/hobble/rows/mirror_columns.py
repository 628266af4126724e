"""How the columns of a row change if the motion is mirrored: left and right swap, some signs change."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.channels import channel
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.rows.layout import CONTACTS, SIDES, RowLayout

POINT = (-1, 1, 1)  # signs that mirror x, y, z of a point or a velocity
ROTATION = (1, -1, -1)  # the same for axis times angle of a rotation; a mirror also reverses every turn


@dataclass(frozen=True)
class ColumnMirror:
    """Mirrors rows of C columns: the mirrored row is row[source] * sign + shift.

    Mirroring twice gives the same row. source: (C,) int, the column that each column is taken from. sign:
    (C,) 1 or -1. shift: (C,), 0 for rows in raw units.
    """

    source: np.ndarray = field(repr=False)
    sign: np.ndarray = field(repr=False)
    shift: Array = field(repr=False)

    def __call__(self, values: Array) -> Array:
        """The mirrored rows of values (..., C)."""
        return values[..., self.source] * self.sign + self.shift

    def standardised(self, mean: Array, std: Array) -> ColumnMirror:
        """The mirror of standardised rows, that is (raw - mean) / std.

        `shift` makes up for the different means of a column and its mirror. Raises HobbleError
        if a column and its mirror are divided by different numbers.
        """
        mean, std = mean.astype(float), std.astype(float)
        if len(odd := np.flatnonzero(std != std[self.source])):
            a, b = odd[0], self.source[odd[0]]
            raise HobbleError(
                f"training.symmetric: columns {a} and {b} of the rows mirror each other, but their standard "
                f"deviations are {std[a]:.6g} and {std[b]:.6g}. Use a data set with `mirror: true`."
            )
        return ColumnMirror(self.source, self.sign, (mean[self.source] * self.sign - mean) / std)


def mirror_of_x(layout: RowLayout, skeleton: Skeleton) -> ColumnMirror:
    """The mirror of the inputs, in raw units. The phase is not a column; the caller moves it by half a cycle.

    Raises HobbleError if the joints or links of the skeleton do not form pairs of left and right.
    """
    collected = _Columns(layout.x_size, skeleton)
    collected.trajectory(layout.x_position)
    collected.trajectory(layout.x_direction)
    collected.joints(layout.x_joint_position, POINT)
    collected.joints(layout.x_joint_velocity, POINT)
    collected.swap(layout.x_terrain, np.arange(len(SIDES))[::-1])
    for name, columns in layout.channels:
        swapped = channel(name).mirror(np.arange(columns, dtype=float)[None], skeleton)[0]
        collected.swap(layout.x_channel(name), swapped.astype(int))
    return collected.mirror()


def mirror_of_y(layout: RowLayout, skeleton: Skeleton) -> ColumnMirror:
    """The mirror of the outputs, in raw units. Raises HobbleError as `mirror_of_x` does."""
    collected = _Columns(layout.y_size, skeleton)
    collected.trajectory(layout.y_root_velocity)
    collected.trajectory(layout.y_position)
    collected.trajectory(layout.y_direction)
    collected.sign[layout.y_turn] = -1
    collected.swap(layout.y_contacts, np.array([CONTACTS.index(_other(name)) for name in CONTACTS]))
    collected.joints(layout.y_joint_position, POINT)
    collected.joints(layout.y_joint_velocity, POINT)
    collected.joints(layout.y_joint_rotation, ROTATION)
    return collected.mirror()


def _other(contact: str) -> str:
    """The contact of the other foot: right_toe for left_toe."""
    side, part = contact.split("_")
    return f"{'right' if side == 'left' else 'left'}_{part}"


class _Columns:
    """Collects the mirror of `count` columns, block by block. A block that is not set stays as it is."""

    def __init__(self, count: int, skeleton: Skeleton) -> None:
        self.source, self.sign, self.swapped = np.arange(count), np.ones(count), skeleton.mirror_joints

    def trajectory(self, block: slice) -> None:
        """Set a block of x of every sample, then z of every sample: x changes its sign."""
        self.sign[block.start : (block.start + block.stop) // 2] = -1

    def joints(self, block: slice, signs: tuple[int, int, int]) -> None:
        """Set a block of x, y, z of every joint: left and right joints swap, signs multiply x, y, z."""
        self.swap(block, self.swapped)
        self.sign[block] = np.tile(signs, len(self.swapped))

    def swap(self, block: slice, order: np.ndarray) -> None:
        """Set a block that consists of equally long parts: part i of the mirrored block is part order[i]."""
        columns = np.arange(block.start, block.stop).reshape(len(order), -1)
        self.source[block] = columns[order].ravel()

    def mirror(self) -> ColumnMirror:
        """The mirror of all columns, after the blocks were set."""
        return ColumnMirror(self.source, self.sign, np.zeros(len(self.source)))
