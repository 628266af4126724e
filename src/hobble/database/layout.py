"""Where everything stands in a row: columns by name, computed from the skeleton, the window and the links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

GAITS = ("stand", "walk", "jog", "crouch", "jump", "bump")
CONTACTS = ("left_heel", "left_toe", "right_heel", "right_toe")
SIDES = ("left", "centre", "right")


@dataclass(frozen=True)
class RowLayout:
    """The columns of X and Y for J joints, a window of `window` frames to each side, and L links.

    With 31 joints, window 60, step 10: X has 342 columns (372 with 30 links) and Y 311. Every property is a
    slice. Blocks that hold vectors are joint-major: x, y, z of joint 0, then joint 1, ...; trajectory
    blocks are component-major: x of every sample, then z of every sample.
    """

    joints: int
    window: int = 60
    step: int = 10
    links: int = 0

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> RowLayout:
        """The inverse of `to_dict`."""
        return cls(**data)

    def to_dict(self) -> dict[str, int]:
        """Plain data for a file."""
        return asdict(self)

    @property
    def offsets(self) -> range:
        """Frames of the trajectory samples relative to the present one: -60, -50, ..., 50."""
        return range(-self.window, self.window, self.step)

    @property
    def samples(self) -> int:
        """Trajectory samples in X (12)."""
        return 2 * self.window // self.step

    @property
    def future(self) -> int:
        """Trajectory samples in Y (6)."""
        return self.window // self.step

    @property
    def x_position(self) -> slice:
        """Trajectory x of every sample, then z; root frame of the present frame, cm."""
        return slice(0, 2 * self.samples)

    @property
    def x_direction(self) -> slice:
        """Trajectory facing direction, x then z."""
        return slice(2 * self.samples, 4 * self.samples)

    @property
    def x_gait(self) -> slice:
        """Six blocks of samples, in the order of GAITS."""
        return slice(4 * self.samples, 10 * self.samples)

    @property
    def x_joint_position(self) -> slice:
        """Joint positions of the previous frame in its root frame, y less the mean terrain height."""
        return slice(10 * self.samples, 10 * self.samples + 3 * self.joints)

    @property
    def x_joint_velocity(self) -> slice:
        """Joint velocities of the previous frame, cm a frame."""
        return slice(self.x_joint_position.stop, self.x_joint_position.stop + 3 * self.joints)

    @property
    def x_terrain(self) -> slice:
        """Heights: +X side (left), centre, other side; less the mean of the centre ones."""
        return slice(self.x_joint_velocity.stop, self.x_joint_velocity.stop + 3 * self.samples)

    @property
    def x_injury(self) -> slice:
        """Severity of each link, 0 to 10; empty without links."""
        return slice(self.x_terrain.stop, self.x_terrain.stop + self.links)

    @property
    def x_size(self) -> int:
        """Columns of X."""
        return self.x_injury.stop

    @property
    def y_root_velocity(self) -> slice:
        """Root velocity x, z in the root frame, cm a frame."""
        return slice(0, 2)

    @property
    def y_turn(self) -> slice:
        """Yaw velocity, radians a frame."""
        return slice(2, 3)

    @property
    def y_phase_change(self) -> slice:
        """Cycles a frame."""
        return slice(3, 4)

    @property
    def y_contacts(self) -> slice:
        """In the order of CONTACTS, 0 or 1."""
        return slice(4, 8)

    @property
    def y_position(self) -> slice:
        """Future trajectory x then z, root frame of the next frame."""
        return slice(8, 8 + 2 * self.future)

    @property
    def y_direction(self) -> slice:
        """Future facing direction x then z."""
        return slice(8 + 2 * self.future, 8 + 4 * self.future)

    @property
    def y_joint_position(self) -> slice:
        """Joint positions of the present frame, root frame, y less the mean terrain height."""
        return slice(self.y_direction.stop, self.y_direction.stop + 3 * self.joints)

    @property
    def y_joint_velocity(self) -> slice:
        """Joint velocities of the present frame."""
        return slice(self.y_joint_position.stop, self.y_joint_position.stop + 3 * self.joints)

    @property
    def y_joint_rotation(self) -> slice:
        """Joint rotations of the present frame in the root frame: axis times half the angle."""
        return slice(self.y_joint_velocity.stop, self.y_joint_velocity.stop + 3 * self.joints)

    @property
    def y_size(self) -> int:
        """Columns of Y."""
        return self.y_joint_rotation.stop

    def blocks(self, prefix: str) -> dict[str, slice]:
        """Every block of "x" or "y" by name, in column order: {"position": slice(0, 24), ...}."""
        names = [n for n in vars(type(self)) if n.startswith(f"{prefix}_") and n != f"{prefix}_size"]
        blocks = {name[2:]: getattr(self, name) for name in names}
        return {name: s for name, s in blocks.items() if s.stop > s.start}
