"""Composes rows of X from the body's columns, the channels, and the ground heights of one terrain fit.

A terrain fit is a set of ground heights that suit the motion. A row may have several, so they are stored
apart from the columns that depend only on the frame. `compose` and `lower_joints` take numpy arrays or
PyTorch tensors, raw or standardised. In shapes, n is the number of rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.rows.layout import RowLayout

TERRAIN = "terrain"  # name of the block of ground heights in X


def body_column_count(layout: RowLayout) -> int:
    """Number of columns of X without terrain and channels."""
    return column_count_without_terrain(layout) - sum(columns for _, columns in layout.channels)


def body_layout(layout: RowLayout) -> RowLayout:
    """`layout` without channels, and with the blocks of X in the order of `hobble.rows.layout.BODY`."""
    return replace(layout, channels=(), order=())


def column_count_without_terrain(layout: RowLayout) -> int:
    """Number of columns of X without terrain. These columns depend only on the frame."""
    return layout.x_size - 3 * layout.samples


def fit_column_count(layout: RowLayout) -> int:
    """Number of values that a database stores for a terrain fit: ground heights and their mean."""
    return 3 * layout.samples + 1


def joint_heights(joints: slice) -> slice:
    """The columns of y, the height, in a block `joints` of joint positions x, y, z."""
    return slice(joints.start + 1, joints.stop, 3)


def frame_inputs(layout: RowLayout, body: Array, channels: Mapping[str, Array]) -> Array:
    """X without its terrain columns, (n, columns), in the order of the layout.

    body: (n, columns) X without terrain and channels, in the order of `body_layout`. channels: channel ->
    values (n, columns).
    """
    if not layout.order:  # the blocks of the body come first, then the channels
        return np.concatenate([body, *(channels[name] for name, _ in layout.channels)], axis=1)
    body_blocks = blocks_without_terrain(body_layout(layout))
    values = {name: body[:, block] for name, block in body_blocks.items()} | dict(channels)
    return np.concatenate([values[name] for name in blocks_without_terrain(layout)], axis=1)


def blocks_without_terrain(layout: RowLayout) -> dict[str, slice]:
    """Name -> columns of each block of X, counted without the terrain columns."""
    terrain = layout.x_terrain
    width = terrain.stop - terrain.start
    return {
        name: slice(block.start - width, block.stop - width) if block.start >= terrain.stop else block
        for name, block in layout.blocks("x").items()
        if name != TERRAIN
    }


def compose(
    layout: RowLayout,
    frames: Any,
    ground: Any,
    mean_height: Any,
    x: Any,
    y: Any,
    x_std: Any = None,
    y_std: Any = None,
) -> None:
    """Fill x (n, X) in place, then subtract `mean_height` from the joint heights of x and y (n, Y) in place.

    frames: (n, columns) X without terrain, see `frame_inputs`. ground: (n, 3 * samples) ground heights. If
    `frames` and `ground` are standardised, so is x. mean_height: (n, 1) mean height of the ground, always in
    cm; None subtracts nothing. x_std (X,), y_std (Y,): standard deviations by which standardised rows were
    divided; None for raw rows.
    """
    terrain = layout.x_terrain
    x[:, : terrain.start] = frames[:, : terrain.start]
    x[:, terrain.stop :] = frames[:, terrain.start :]
    x[:, terrain] = ground
    if mean_height is not None:
        lower_joints(x, layout.x_joint_position, mean_height, x_std)
        lower_joints(y, layout.y_joint_position, mean_height, y_std)


def lower_joints(values: Any, joints: slice, by: Any, std: Any = None) -> None:
    """Subtract `by` (n, 1), in cm, from the joint heights in `values` (n, columns), in place.

    joints: the block of joint positions. std: (columns,) by which standardised values were divided; None for
    raw values.
    """
    heights = joint_heights(joints)
    values[:, heights] -= by if std is None else by / std[heights]
