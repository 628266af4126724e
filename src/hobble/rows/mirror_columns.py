"""Mirrors rows, as if the motion were mirrored: left and right columns swap, and some columns change sign."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.channels import channel
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.rows.layout import CONTACTS, SIDES, RowLayout

POINT = (-1, 1, 1)  # signs that mirror x, y, z of a point or a velocity: +x is the left
# Signs that mirror x, y, z of a rotation, given as axis times angle. They are the negative of POINT, because
# a mirror also reverses the sense of every turn.
ROTATION = (1, -1, -1)


@dataclass(frozen=True)
class ColumnMirror:
    """Mirrors rows of C columns: the mirrored row is row[source] * sign + shift.

    Mirroring twice gives the original row. source: (C,) int, the column from which each column is taken.
    sign: (C,) 1 or -1. shift: (C,) what is added; 0 unless the rows are standardised.
    """

    source: np.ndarray = field(repr=False)
    sign: np.ndarray = field(repr=False)
    shift: Array = field(repr=False)

    def __call__(self, values: Array) -> Array:
        """Mirror the rows `values` (..., C)."""
        return values[..., self.source] * self.sign + self.shift

    def for_standardised_rows(self, mean: Array, std: Array) -> ColumnMirror:
        """The mirror of rows that are standardised: (row - mean) / std. mean, std: (C,).

        `shift` makes up for the different means of a column and its mirror. Raises HobbleError if a column
        and its mirror have different standard deviations.
        """
        mean, std = mean.astype(float), std.astype(float)
        if len(unequal := np.flatnonzero(std != std[self.source])):
            a, b = unequal[0], self.source[unequal[0]]
            raise HobbleError(
                f"training.symmetric: columns {a} and {b} of the rows mirror each other, but their standard "
                f"deviations are {std[a]:.6g} and {std[b]:.6g}. Use a data set with `mirror: true`."
            )
        return ColumnMirror(self.source, self.sign, (mean[self.source] * self.sign - mean) / std)


def mirror_of_x(layout: RowLayout, skeleton: Skeleton) -> ColumnMirror:
    """The mirror of rows of X that are not standardised.

    The phase is not a column of X. The caller has to add half a cycle to it. Raises HobbleError if the joints
    or links of the skeleton do not form pairs of left and right.
    """
    # The gait shares are not mentioned, because they stay the same.
    collected = _Columns(layout.x_size, skeleton)
    collected.trajectory(layout.x_position)
    collected.trajectory(layout.x_direction)
    collected.joints(layout.x_joint_position, POINT)
    collected.joints(layout.x_joint_velocity, POINT)
    collected.swap(layout.x_terrain, np.arange(len(SIDES))[::-1])
    for name, columns in layout.channels:
        # Mirrors the numbers of the columns, which shows from which column each one is taken.
        swapped = channel(name).mirror(np.arange(columns, dtype=float)[None], skeleton)[0]
        collected.swap(layout.x_channel(name), swapped.astype(int))
    return collected.mirror()


def mirror_of_y(layout: RowLayout, skeleton: Skeleton) -> ColumnMirror:
    """The mirror of rows of Y that are not standardised. Raises HobbleError as `mirror_of_x` does."""
    # The change of phase is not mentioned, because it stays the same.
    collected = _Columns(layout.y_size, skeleton)
    collected.trajectory(layout.y_root_velocity)
    collected.trajectory(layout.y_position)
    collected.trajectory(layout.y_direction)
    collected.sign[layout.y_turn] = -1
    collected.swap(layout.y_contacts, np.array([CONTACTS.index(_on_other_foot(name)) for name in CONTACTS]))
    collected.joints(layout.y_joint_position, POINT)
    collected.joints(layout.y_joint_velocity, POINT)
    collected.joints(layout.y_joint_rotation, ROTATION)
    return collected.mirror()


def _on_other_foot(contact: str) -> str:
    """The name of the same contact of the other foot: right_toe for left_toe."""
    side, part = contact.split("_")
    return f"{'right' if side == 'left' else 'left'}_{part}"


class _Columns:
    """Collects the mirror of `count` columns, block by block. Columns of all other blocks stay the same."""

    def __init__(self, count: int, skeleton: Skeleton) -> None:
        self.source, self.sign = np.arange(count), np.ones(count)
        self.mirror_joints = skeleton.mirror_joints

    def trajectory(self, block: slice) -> None:
        """Mirror a block that has x of every sample, then z of every sample: x changes its sign."""
        self.sign[block.start : (block.start + block.stop) // 2] = -1

    def joints(self, block: slice, signs: tuple[int, int, int]) -> None:
        """Mirror a block that has x, y, z of every joint.

        Left and right joints swap, and x, y, z are multiplied by `signs`.
        """
        self.swap(block, self.mirror_joints)
        self.sign[block] = np.tile(signs, len(self.mirror_joints))

    def swap(self, block: slice, order: np.ndarray) -> None:
        """Mirror a block of equally long parts by changing their order.

        Part i of the mirrored block is part order[i] of the block.
        """
        columns = np.arange(block.start, block.stop).reshape(len(order), -1)
        self.source[block] = columns[order].ravel()

    def mirror(self) -> ColumnMirror:
        """The mirror of all columns. Call it after the blocks are mirrored."""
        return ColumnMirror(self.source, self.sign, np.zeros(len(self.source)))
