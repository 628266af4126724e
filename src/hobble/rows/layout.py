"""Which columns of X (inputs) and Y (outputs) hold what: names for blocks of columns.

The columns depend on the skeleton, the window of the trajectory, and the channels.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import ConfigDict, Field

from hobble.channels import channel
from hobble.channels.channel import read_through_curve
from hobble.core.declared import read_declared
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import printable
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.labels.local_phase import MIRRORED_PARTS

GAITS = ("stand", "walk", "jog", "crouch", "jump", "bump")
CONTACTS = ("left_heel", "left_toe", "right_heel", "right_toe")
MOST_COLUMNS = 1 << 16  # of X or Y
SIDES = ("left", "centre", "right")  # where X has ground heights: left of the path, on it, right of it
Count = Annotated[int, Field(strict=True, ge=0, le=MOST_COLUMNS)]
AtLeastOne = Annotated[Count, Field(ge=1)]
LOCAL = "local_phase"  # name of the block of local phases in X and Y
# The blocks of X that every network has, in the order of Holden et al. (2017).
BODY = ("position", "direction", "gait", "joint_position", "joint_velocity", "terrain")


class _Block:
    """A block of columns: the attribute `x_gait` of a layout is its slice "gait" of X."""

    def __set_name__(self, owner: type, name: str) -> None:
        self.table, self.name = f"_{name[0]}_blocks", name[2:]

    def __get__(self, layout: RowLayout, owner: type | None = None) -> slice:
        found: slice = getattr(layout, self.table)[self.name]
        return found


def _side_by_side(sizes: Mapping[str, int]) -> dict[str, slice]:
    """Name -> columns of blocks of these sizes, one after another."""
    ends = np.cumsum([0, *sizes.values()]).tolist()
    return {name: slice(*columns) for name, columns in zip(sizes, pairwise(ends), strict=True)}


@dataclass(frozen=True)
class RowLayout:
    """The columns of X (inputs) and Y (outputs) of the network. Each block of columns is a slice.

    joints: number of joints. window: frames of the trajectory before and after the present frame. step:
    frames between two samples of the trajectory. channels: (name, number of columns) of each channel.
    local_phases: number of parts of the body with a phase of their own (`hobble.labels.local_phase`). Rows
    with local phases have the rotations of the joints in X, too. In X, the blocks of BODY come first, then
    the local phases, then the rotations, then the channels.

    With 31 joints, window 60 and step 10, X has 342 columns and Y has 311. With a channel of 30 columns, X
    has 372. Joint blocks hold x, y, z of joint 0, then of joint 1, and so on. Trajectory blocks hold x of
    every sample, then z of every sample.
    """

    __pydantic_config__ = ConfigDict(extra="forbid")
    joints: AtLeastOne
    window: AtLeastOne = 60
    step: AtLeastOne = 10
    channels: tuple[tuple[str, Count], ...] = ()
    local_phases: Count = 0

    def __post_init__(self) -> None:
        if self.window % self.step:
            raise ValueError(f"window {self.window} is not a multiple of step {self.step}")

    def to_dict(self) -> dict[str, Any]:
        """The layout as data that JSON can hold, for `layout_from_data`."""
        sizes = {"joints": self.joints, "window": self.window, "step": self.step}
        sizes |= {"local_phases": self.local_phases} if self.local_phases else {}
        return {**sizes, "channels": [list(pair) for pair in self.channels]}

    def with_channels(self, names: Iterable[str], local_phases: bool = True) -> RowLayout:
        """The layout with only the channels `names`, in the order of `names`.

        local_phases: whether the local phases, and the rotations in X, stay. They are the last columns of Y,
        and in X the last ones before the channels. Raises KeyError if the layout lacks one of these channels.
        """
        size = dict(self.channels)
        kept = self.local_phases if local_phases else 0
        return replace(self, channels=tuple((name, size[name]) for name in names), local_phases=kept)

    def serves(self, network: RowLayout) -> bool:
        """Whether rows with this layout have all columns of a network's. They may have more of them."""
        same_motion = self.with_channels((), False) == network.with_channels((), False)
        enough = self.local_phases >= network.local_phases
        return same_motion and enough and set(network.channels) <= set(self.channels)

    @property
    def offsets(self) -> range:
        """Frames from the present frame to each trajectory sample: by default -60, -50, ..., 50."""
        return range(-self.window, self.window, self.step)

    @property
    def samples(self) -> int:
        """Number of trajectory samples in X; 12 by default."""
        return 2 * self.window // self.step

    @property
    def future(self) -> int:
        """Number of trajectory samples in Y, which has only the future; 6 by default."""
        return self.window // self.step

    @cached_property
    def _x_blocks(self) -> dict[str, slice]:
        """Name -> columns of each block of X, in column order."""
        each, joints = self.samples, 3 * self.joints
        columns = (2 * each, 2 * each, len(GAITS) * each, joints, joints, 3 * each)
        sizes = dict(zip(BODY, columns, strict=True))
        turns = joints if self.local_phases else 0
        return _side_by_side(
            sizes | {LOCAL: 2 * self.local_phases, "joint_rotation": turns} | dict(self.channels)
        )

    # Trajectory positions, x then z, in the root coordinates of the row's frame, cm.
    x_position = _Block()
    # Trajectory facing directions, x then z, in the root coordinates of the row's frame.
    x_direction = _Block()
    # Gait shares: all trajectory samples of the first of GAITS, then of the second, and so on.
    x_gait = _Block()
    # Joint positions of the previous frame in its root coordinates, cm, y above the mean ground.
    x_joint_position = _Block()
    # Joint velocities of the previous frame in its root coordinates, cm a frame.
    x_joint_velocity = _Block()
    # Ground heights at the trajectory samples, cm above the mean height on the path. All samples left (+x) of
    # the path come first, then those on it, then those right of it.
    x_terrain = _Block()

    # Local phases now: cosine and sine times the amplitude, of each part of the body.
    x_local_phase = _Block()
    # Joint rotations of the previous frame in its root coordinates, as in Y; only beside local phases.
    x_joint_rotation = _Block()

    def x_channel(self, name: str) -> slice:
        """The columns of a channel. Raises KeyError if there is no such channel."""
        return self._x_blocks[name]

    @property
    def x_size(self) -> int:
        """Number of columns of X."""
        return max(block.stop for block in self._x_blocks.values())

    # Root velocity, x and z in root coordinates, cm a frame.
    y_root_velocity = _Block()
    # Yaw velocity, radians a frame, with the sign of `hobble.motion.root.RootFrames.turn`.
    y_turn = _Block()
    # Change of phase, cycles a frame.
    y_phase_change = _Block()
    # Whether each of CONTACTS touches the ground: 0 or 1.
    y_contacts = _Block()
    # Future trajectory positions, x then z, in the root coordinates of the next frame, cm.
    y_position = _Block()
    # Future facing directions, x then z, in the root coordinates of the next frame.
    y_direction = _Block()
    # Joint positions of this frame in its root coordinates, cm, y above the mean ground.
    y_joint_position = _Block()
    # Joint velocities of this frame in its root coordinates, cm a frame.
    y_joint_velocity = _Block()
    # Joint rotations of this frame in its root coordinates: axis times half the angle, radians. See
    # `hobble.motion.root.usual_rotations`.
    y_joint_rotation = _Block()
    # Local phases in the next frame, as in X.
    y_local_phase = _Block()
    # By how much the angle of each local phase changes until then, cycles.
    y_local_change = _Block()

    @cached_property
    def _y_blocks(self) -> dict[str, slice]:
        """Name -> columns of each block of Y, in column order."""
        trajectory, joints = 2 * self.future, 3 * self.joints
        sizes = {"root_velocity": 2, "turn": 1, "phase_change": 1, "contacts": len(CONTACTS)}
        sizes |= {"position": trajectory, "direction": trajectory}
        sizes |= {"joint_position": joints, "joint_velocity": joints, "joint_rotation": joints}
        sizes |= {LOCAL: 2 * self.local_phases, "local_change": self.local_phases}
        return _side_by_side(sizes)

    @property
    def y_size(self) -> int:
        """Number of columns of Y."""
        return self.y_local_change.stop

    def blocks(self, prefix: str) -> dict[str, slice]:
        """All blocks of X ("x") or Y ("y") by name, in column order: {"position": slice(0, 24), ...}."""
        blocks = self._x_blocks if prefix == "x" else self._y_blocks
        return {name: block for name, block in blocks.items() if block.stop > block.start}


def layout_from_data(path: str | Path, data: Any, fix: str | None = None) -> RowLayout:
    """The layout of `RowLayout.to_dict`, or of its JSON text, in the file `path`.

    Raises InputError, with the advice `fix`, if it is not valid.
    """
    try:
        data = json.loads(data) if isinstance(data, str) else data
    except (ValueError, RecursionError) as error:
        raise InputError(path, printable(f"its layout is not valid JSON: {error}", 400), fix=fix) from None
    return read_declared(path, "its layout", RowLayout, data, fix)


# Composes rows of X from the body's columns, the channels, and the ground heights of one terrain fit.
#
# A terrain fit is a set of ground heights that suit the motion. A row may have several, so they are stored
# apart from the columns that depend only on the frame. `compose` and `lower_joints` take numpy arrays or
# PyTorch tensors, raw or standardised. In shapes, n is the number of rows.


TERRAIN = "terrain"  # name of the block of ground heights in X


def body_layout(layout: RowLayout) -> RowLayout:
    """`layout` without channels."""
    return replace(layout, channels=())


def column_count_without_terrain(layout: RowLayout) -> int:
    """Number of columns of X without terrain. These columns depend only on the frame."""
    return layout.x_size - 3 * layout.samples


def fit_column_count(layout: RowLayout) -> int:
    """Number of values that a database stores for a terrain fit: ground heights and their mean."""
    return 3 * layout.samples + 1


def frame_inputs(layout: RowLayout, body: Array, channels: Mapping[str, Array]) -> Array:
    """X without its terrain columns, (n, columns), in the order of the layout.

    body: (n, columns) X without terrain and channels; it may have local phases that the layout lacks.
    channels: channel -> values (n, columns), which X holds as `read_through_curve` gives them.
    """
    values = [channel_inputs(name, channels[name]) for name, _ in layout.channels]
    return np.concatenate([body_inputs(layout, body), *values], axis=1)


def body_inputs(layout: RowLayout, body: Array) -> Array:
    """The columns of `body`, as for `frame_inputs`, that the layout has."""
    return body[:, : column_count_without_terrain(body_layout(layout))]


def channel_inputs(name: str, values: Array) -> Array:
    """The columns of X (n, columns) of the channel `name` with these values (n, columns)."""
    read: Array = read_through_curve(values, channel(name).highest, channel(name).exponent)
    return read


def pose_blocks(blocks: Mapping[str, slice]) -> list[slice]:
    """The blocks of X with three columns for each joint: positions, velocities, then any rotations.

    blocks: name -> columns, from `RowLayout.blocks` or `blocks_without_terrain`.
    """
    names = ("joint_position", "joint_velocity", "joint_rotation")
    return [blocks[name] for name in names if name in blocks]


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
    heights = slice(joints.start + 1, joints.stop, 3)  # the columns of y
    values[:, heights] -= by if std is None else by / std[heights]


# Mirrors rows, as if the motion were mirrored: left and right columns swap, and some columns change sign.


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
    collected.trajectory(layout.x_position, layout.x_direction)
    collected.joints(POINT, layout.x_joint_position, layout.x_joint_velocity)
    collected.swap(layout.x_terrain, np.arange(len(SIDES))[::-1])
    collected.parts(layout.x_local_phase)
    collected.joints(ROTATION, layout.x_joint_rotation)
    for name, columns in layout.channels:
        # Mirrors the numbers of the columns, which shows from which column each one is taken.
        swapped = channel(name).mirror(np.arange(columns, dtype=float)[None], skeleton)[0]
        collected.swap(layout.x_channel(name), swapped.astype(int))
    return collected.mirror()


def mirror_of_y(layout: RowLayout, skeleton: Skeleton) -> ColumnMirror:
    """The mirror of rows of Y that are not standardised. Raises HobbleError as `mirror_of_x` does."""
    # The change of phase is not mentioned, because it stays the same.
    collected = _Columns(layout.y_size, skeleton)
    collected.trajectory(layout.y_root_velocity, layout.y_position, layout.y_direction)
    collected.sign[layout.y_turn] = -1
    collected.swap(layout.y_contacts, np.array([2, 3, 0, 1]))  # left and right of CONTACTS
    collected.joints(POINT, layout.y_joint_position, layout.y_joint_velocity)
    collected.joints(ROTATION, layout.y_joint_rotation)
    collected.parts(layout.y_local_phase)
    collected.parts(layout.y_local_change)
    return collected.mirror()


class _Columns:
    """Collects the mirror of `count` columns, block by block. Columns of all other blocks stay the same."""

    def __init__(self, count: int, skeleton: Skeleton) -> None:
        self.source, self.sign = np.arange(count), np.ones(count)
        self.mirror_joints = skeleton.mirror_joints

    def trajectory(self, *blocks: slice) -> None:
        """Mirror blocks that have x of every sample, then z of every sample: x changes its sign."""
        for block in blocks:
            self.sign[block.start : (block.start + block.stop) // 2] = -1

    def joints(self, signs: tuple[int, int, int], *blocks: slice) -> None:
        """Mirror blocks that have x, y, z of every joint.

        Left and right joints swap, and x, y, z are multiplied by `signs`. A block may be empty.
        """
        for block in blocks:
            if block.stop > block.start:
                self.swap(block, self.mirror_joints)
                self.sign[block] = np.tile(signs, len(self.mirror_joints))

    def parts(self, block: slice) -> None:
        """Mirror a block of local phases, which may be empty: the parts of the body swap."""
        if block.stop > block.start:
            self.swap(block, np.array(MIRRORED_PARTS))

    def swap(self, block: slice, order: np.ndarray) -> None:
        """Mirror a block of equally long parts by changing their order.

        Part i of the mirrored block is part order[i] of the block.
        """
        columns = np.arange(block.start, block.stop).reshape(len(order), -1)
        self.source[block] = columns[order].ravel()

    def mirror(self) -> ColumnMirror:
        """The mirror of all columns. Call it after the blocks are mirrored."""
        return ColumnMirror(self.source, self.sign, np.zeros(len(self.source)))
