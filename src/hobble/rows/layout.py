"""Which columns of X (inputs) and Y (outputs) hold what: names for blocks of columns.

The columns depend on the skeleton, the window of the trajectory, and the channels.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from hobble.channels import channel_of_old_key

GAITS = ("stand", "walk", "jog", "crouch", "jump", "bump")
CONTACTS = ("left_heel", "left_toe", "right_heel", "right_toe")
SIDES = ("left", "centre", "right")  # where X has ground heights: left of the path, on it, right of it
# The blocks of X that every network has, in the order of Holden et al. (2017).
BODY = ("position", "direction", "gait", "joint_position", "joint_velocity", "terrain")


@dataclass(frozen=True)
class RowLayout:
    """The columns of X (inputs) and Y (outputs) of the network. Each block of columns is a slice.

    joints: number of joints. window: frames of the trajectory before and after the present frame. step:
    frames between two samples of the trajectory. channels: (name, number of columns) of each channel. order:
    names of all blocks of X in column order. If `order` is empty, the blocks of BODY come first, then the
    channels. Raises ValueError if `order` is not empty and does not name each of these blocks once.

    With 31 joints, window 60 and step 10, X has 342 columns and Y has 311. With a channel of 30 columns, X
    has 372. Joint blocks hold x, y, z of joint 0, then of joint 1, and so on. Trajectory blocks hold x of
    every sample, then z of every sample.
    """

    joints: int
    window: int = 60
    step: int = 10
    channels: tuple[tuple[str, int], ...] = ()
    order: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.order and sorted(self.order) != sorted((*BODY, *dict(self.channels))):
            raise ValueError(
                "the order of the blocks of X has to name each of these once: "
                + ", ".join((*BODY, *dict(self.channels)))
            )

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> RowLayout:
        """The layout from the data of `to_dict`.

        In old files, the number of a channel's columns is under one of its `old_keys` instead.
        """
        numbers = {key: data[key] for key in ("joints", "window", "step") if key in data}
        channels = dict(data.get("channels", {}))
        for key in set(data) - {"joints", "window", "step", "channels", "order"}:
            if data[key]:
                channels[channel_of_old_key(key)] = data[key]
        pairs = tuple((str(name), int(columns)) for name, columns in channels.items())
        return cls(**numbers, channels=pairs, order=tuple(data.get("order", ())))

    def to_dict(self) -> dict[str, Any]:
        """The layout as data that JSON can hold, for `from_dict`."""
        order = {"order": list(self.order)} if self.order else {}
        sizes = {"joints": self.joints, "window": self.window, "step": self.step}
        return {**sizes, "channels": [list(pair) for pair in self.channels], **order}

    def with_channels(self, names: Iterable[str]) -> RowLayout:
        """The layout with only the channels `names`, in the order of `names`.

        Raises KeyError if the layout does not have one of these channels.
        """
        size = dict(self.channels)
        kept = tuple((name, size[name]) for name in names)
        order = tuple(name for name in self.order if name in BODY or name in dict(kept))
        return replace(self, channels=kept, order=order)

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
        trajectory, joints = 2 * self.samples, 3 * self.joints
        sizes = dict(
            zip(
                BODY,
                (trajectory, trajectory, len(GAITS) * self.samples, joints, joints, 3 * self.samples),
                strict=True,
            )
        )
        sizes |= dict(self.channels)
        blocks, start = {}, 0
        for name in self.order or sizes:
            blocks[name] = slice(start, start + sizes[name])
            start += sizes[name]
        return blocks

    @property
    def x_position(self) -> slice:
        """Trajectory positions, x then z, in the root coordinates of the row's frame, cm."""
        return self._x_blocks["position"]

    @property
    def x_direction(self) -> slice:
        """Trajectory facing directions, x then z, in the root coordinates of the row's frame."""
        return self._x_blocks["direction"]

    @property
    def x_gait(self) -> slice:
        """Gait shares: all trajectory samples of the first of GAITS, then of the second, and so on."""
        return self._x_blocks["gait"]

    @property
    def x_joint_position(self) -> slice:
        """Joint positions of the previous frame in its root coordinates, cm, y above the mean ground."""
        return self._x_blocks["joint_position"]

    @property
    def x_joint_velocity(self) -> slice:
        """Joint velocities of the previous frame in its root coordinates, cm a frame."""
        return self._x_blocks["joint_velocity"]

    @property
    def x_terrain(self) -> slice:
        """Ground heights at the trajectory samples, cm above the mean height on the path.

        All samples left (+x) of the path come first, then those on it, then those right of it.
        """
        return self._x_blocks["terrain"]

    def x_channel(self, name: str) -> slice:
        """The columns of a channel. Raises KeyError if there is no such channel."""
        return self._x_blocks[name]

    @property
    def x_size(self) -> int:
        """Number of columns of X."""
        return max(block.stop for block in self._x_blocks.values())

    @property
    def y_root_velocity(self) -> slice:
        """Root velocity, x and z in root coordinates, cm a frame."""
        return slice(0, 2)

    @property
    def y_turn(self) -> slice:
        """Yaw velocity, radians a frame, with the sign of `hobble.motion.root.RootFrames.turn`."""
        return slice(2, 3)

    @property
    def y_phase_change(self) -> slice:
        """Change of phase, cycles a frame."""
        return slice(3, 4)

    @property
    def y_contacts(self) -> slice:
        """Whether each of CONTACTS touches the ground: 0 or 1."""
        return slice(4, 8)

    @property
    def y_position(self) -> slice:
        """Future trajectory positions, x then z, in the root coordinates of the next frame, cm."""
        return slice(8, 8 + 2 * self.future)

    @property
    def y_direction(self) -> slice:
        """Future facing directions, x then z, in the root coordinates of the next frame."""
        return slice(8 + 2 * self.future, 8 + 4 * self.future)

    @property
    def y_joint_position(self) -> slice:
        """Joint positions of this frame in its root coordinates, cm, y above the mean ground."""
        return slice(self.y_direction.stop, self.y_direction.stop + 3 * self.joints)

    @property
    def y_joint_velocity(self) -> slice:
        """Joint velocities of this frame in its root coordinates, cm a frame."""
        return slice(self.y_joint_position.stop, self.y_joint_position.stop + 3 * self.joints)

    @property
    def y_joint_rotation(self) -> slice:
        """Joint rotations of this frame in its root coordinates: axis times half the angle, radians."""
        return slice(self.y_joint_velocity.stop, self.y_joint_velocity.stop + 3 * self.joints)

    @property
    def y_size(self) -> int:
        """Number of columns of Y."""
        return self.y_joint_rotation.stop

    def blocks(self, prefix: str) -> dict[str, slice]:
        """All blocks of X ("x") or Y ("y") by name, in column order: {"position": slice(0, 24), ...}."""
        if prefix == "x":
            return {name: block for name, block in self._x_blocks.items() if block.stop > block.start}
        # `vars` lists the properties in the order of their definition, which is the column order of Y.
        names = [n for n in vars(type(self)) if n.startswith("y_") and n != "y_size"]
        return {name[2:]: getattr(self, name) for name in names}
