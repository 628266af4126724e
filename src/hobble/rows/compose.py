"""How a row is put together: the columns of a frame, what the body is told, and the ground of one terrain
fit.

One composition for numpy's arrays and PyTorch's tensors, raw or standardised. `n` is a number of rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.rows.layout import RowLayout

TERRAIN = "terrain"


def body_columns(layout: RowLayout) -> int:
    """Columns of X without the terrain and without channels."""
    return x_columns(layout) - sum(columns for _, columns in layout.channels)


def body_layout(layout: RowLayout) -> RowLayout:
    """The blocks of X in the order of BODY, without channels."""
    return replace(layout, channels=(), order=())


def x_columns(layout: RowLayout) -> int:
    """Columns of X without the terrain: those of a frame."""
    return layout.x_size - 3 * layout.samples


def fit_columns(layout: RowLayout) -> int:
    """Columns of a database's `fits`: the heights, then the lift."""
    return 3 * layout.samples + 1


def joint_heights(joints: slice) -> slice:
    """The heights in a block of joint positions."""
    return slice(joints.start + 1, joints.stop, 3)


def frame_inputs(layout: RowLayout, body: Array, channels: Mapping[str, Array]) -> Array:
    """(n, X without the terrain) in the layout's order.

    body: (n, body columns), the blocks of X but for terrain and channels, in the order of BODY. channels:
    name -> (n, its columns).
    """
    if not layout.order:  # the channels stand behind
        return np.concatenate([body, *(channels[name] for name, _ in layout.channels)], axis=1)
    bare = without_terrain(body_layout(layout))
    source = {name: body[:, block] for name, block in bare.items()} | dict(channels)
    return np.concatenate([source[name] for name in without_terrain(layout)], axis=1)


def without_terrain(layout: RowLayout) -> dict[str, slice]:
    """The blocks of X as they lie where the terrain is taken out."""
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
    lift: Any,
    x: Any,
    y: Any,
    x_std: Any = None,
    y_std: Any = None,
) -> None:
    """Fill x (n, X), and take from the joint heights of x and y (n, Y) what the ground is higher.

    frames: (n, X without the terrain), ground: (n, 3 * samples), both in the units of x. lift: (n, 1) cm, or
    None for nothing. x_std, y_std: (X,), (Y,) what standardised rows were divided by; None for raw ones.
    """
    terrain = layout.x_terrain
    x[:, : terrain.start] = frames[:, : terrain.start]
    x[:, terrain.stop :] = frames[:, terrain.start :]
    x[:, terrain] = ground
    if lift is not None:
        lower_joints(x, layout.x_joint_position, lift, x_std)
        lower_joints(y, layout.y_joint_position, lift, y_std)


def lower_joints(values: Any, joints: slice, by: Any, std: Any = None) -> None:
    """Take `by` (n, 1) cm from the heights in the block `joints` of values (n, columns)."""
    heights = joint_heights(joints)
    values[:, heights] -= by if std is None else by / std[heights]
