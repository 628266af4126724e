"""What the caller gives and gets: targets, which are checked, and poses, in the caller's axes and unit.

Hobble's are right-handed, Y up, +Z forward, cm.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.runtime.bounds import JOG_FROM
from hobble.runtime.network_rows import UnknownName
from hobble.runtime.trajectory import STILL

# (handedness, up axis) of the caller -> matrix from Hobble's left, up, forward to the caller's x, y, z.
MATRICES = {
    ("right", "Y"): ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    # Unity: x to the right, z forward.
    ("left", "Y"): ((-1, 0, 0), (0, 1, 0), (0, 0, 1)),
    # Blender: the character faces -y, and its left is +x.
    ("right", "Z"): ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    # Unreal: x forward, y to the right.
    ("left", "Z"): ((0, 0, 1), (-1, 0, 0), (0, 1, 0)),
}
UNITS = {"cm": 1.0, "m": 0.01}  # unit of the caller -> length of one centimetre in this unit


@dataclass(frozen=True)
class Axes:
    """The caller's convention: handedness, up axis, unit of length, and how large the character is.

    handed: whether the axes are right-handed or left-handed. size: how many times as large as in training the
    character is; steps, speeds and the ground under it are in the caller's unit at any size. In every
    convention, velocities are per frame at 60 Hz, and quaternions have w first.
    """

    handed: Literal["right", "left"] = "right"
    up: Literal["Y", "Z"] = "Y"
    unit: Literal["cm", "m"] = "cm"
    size: float = 1.0

    def __post_init__(self) -> None:
        if (self.handed, self.up) not in MATRICES or self.unit not in UNITS:
            raise ValueError(
                f"{self}: handed has to be right or left, up has to be Y or Z, unit has to be cm or m"
            )
        if not 0 < self.size < np.inf:
            raise ValueError(f"size is {self.size!r}, but has to be more than 0, and finite")

    @property
    def is_native(self) -> bool:
        """Whether this is Hobble's own convention. Then no conversion is needed."""
        return (self.handed, self.up, self.unit, self.size) == ("right", "Y", "cm", 1.0)

    @property
    def matrix(self) -> Array:
        """(3, 3) matrix from Hobble's directions to the caller's. It swaps axes and changes signs."""
        return np.array(MATRICES[self.handed, self.up], float)

    @property
    def scale(self) -> float:
        """Length of one centimetre of the character in training, in the caller's unit."""
        return UNITS[self.unit] * self.size

    def directions_to_caller(self, v: Array) -> Array:
        """Convert Hobble's directions (..., 3) to the caller's."""
        return v @ self.matrix.T

    def directions_from_caller(self, v: Array) -> Array:
        """Convert the caller's directions (..., 3) to Hobble's."""
        return v @ self.matrix

    def points_to_caller(self, p: Array) -> Array:
        """Convert Hobble's positions or velocities (..., 3), cm, to the caller's."""
        return self.directions_to_caller(p) * self.scale

    def points_from_caller(self, p: Array) -> Array:
        """Convert the caller's positions or velocities (..., 3) to Hobble's, cm."""
        return self.directions_from_caller(p) / self.scale

    def rotations_to_caller(self, q: Array) -> Array:
        """Convert Hobble's rotations (..., 4) to the caller's.

        As matrices, a rotation R becomes M R M^-1, where M is `matrix`. In a quaternion, this converts the
        axis as a direction, and negates it if the handedness changes.
        """
        out = np.array(q, float)
        out[..., 1:] = self.directions_to_caller(out[..., 1:]) * np.linalg.det(self.matrix).round()
        return out


@dataclass(frozen=True)
class Pose:
    """The pose of C characters in one frame. If there is only one character, the arrays have no axis C.

    The caller may keep the pose and change its arrays.
    positions: (C, J, 3) joint positions in the world, in the caller's axes and unit. rotations: (C, J, 4)
    joint rotations in the world, in the caller's axes, as quaternions with w first. contacts: (C, 4)
    predicted contact of left heel, left toe, right heel and right toe, from 0 to 1; 0 while the runtime makes
    the foot step. phase: (C,) in cycles, 0 to 1. root: (C, 3) point on the ground below the hips, in the
    caller's axes and unit. yaw: (C,) direction that the root faces, in radians and always in Hobble's axes: 0
    is +Z, and the angle grows to the left. channels: channel -> values (C, columns) that the network got.
    """

    positions: Array = field(repr=False)
    rotations: Array = field(repr=False)
    contacts: Array
    phase: Any
    root: Array
    yaw: Any
    channels: Mapping[str, Array] = field(repr=False)

    def __getitem__(self, k: int) -> Pose:
        """The pose of character k of several."""
        channels = {name: values[k] for name, values in self.channels.items()}
        return Pose(
            self.positions[k], self.rotations[k], self.contacts[k], float(self.phase[k]), self.root[k],
            float(self.yaw[k]), channels,
        )  # fmt: skip


def world_rotations(turns: Array, yaw: Array) -> Array:
    """(..., J, 4) rotations of joints in the world, from rotations relative to the root.

    turns: (..., J, 3) these rotations, as axis times half the angle. yaw: (...) direction that the root
    faces, radians.
    """
    return quat.mul(quat.yaw(yaw)[..., None, :], quat.exp(turns.astype(float)))


# Checks and converts the targets that the caller gives: velocity, facing and gait of each character.


# Highest target speed, cm a frame (18 m/s). People are slower: sprinters reach 21 cm a frame.
FASTEST = 30.0
TURN_IN_PLACE = np.radians(20)  # a standing character steps on the spot if it has to turn by more than this


class CallerTargets:
    """Checks and converts the targets of C characters.

    gaits: names of the network's G gaits. axes: the caller's axes and unit. characters: C.
    """

    def __init__(self, gaits: Sequence[str], axes: Axes, characters: int) -> None:
        self.axes, self.characters = axes, characters
        self._gaits = {name: i for i, name in enumerate(gaits)}  # name -> column among the shares
        self._shares = np.zeros((characters, len(gaits)))

    def velocity(self, velocity: Any) -> Array:
        """The caller's target velocity as Hobble's x, z (C, 2), cm a frame.

        Raises ValueError for a speed above FASTEST, and as `ground_vector` does.
        """
        target = self.ground_vector("target_velocity", velocity)
        if (fastest := np.hypot(target[:, 0], target[:, 1]).max()) > FASTEST:
            most = f"It may be {FASTEST:g} cm a frame at most ({FASTEST * 0.6:g} m/s at 60 frames a second)"
            raise ValueError(
                f"target_velocity is {fastest:.4g} cm a frame, faster than a body can move. {most}"
            )
        return target

    def ground_vector(self, what: str, vector: Any) -> Array:
        """The caller's vector, or one for each character, as Hobble's x, z (C, 2).

        A vector has three components, or two without the height. what: its name; that of a "facing" has any
        length. Raises ValueError for a wrong shape or a number that is not finite.
        """
        v = np.asarray(vector, float)
        if (
            v.shape[-1:] not in ((2,), (3,))
            or v.ndim > 2
            or v.shape[:-1] not in ((), (1,), (self.characters,))
        ):
            each = f", or one for each of {self.characters}" if self.characters > 1 else ""
            raise ValueError(f"{what} has to be a vector of 2 or 3 components{each}, not of shape {v.shape}")
        if not np.isfinite(v).all():
            raise ValueError(f"{what} is not a finite vector: {vector}")
        if v.shape[-1] == 2:
            if self.axes.is_native:
                return np.array(np.broadcast_to(v, (self.characters, 2)), order="C")
            full = np.zeros((*v.shape[:-1], 3))  # with height 0
            full[..., [k for k in range(3) if k != "XYZ".index(self.axes.up)]] = v
            v = full
        if not self.axes.is_native:
            v = (self.axes.directions_from_caller if what == "facing" else self.axes.points_from_caller)(v)
        return np.array(np.broadcast_to(v[..., ::2], (self.characters, 2)), order="C")

    def gait_shares(self, velocity: Array, direction: Array, heading: Array, gait: Any) -> Array:
        """Target shares (C, G) of the gaits, from the caller's gait. The next call overwrites them.

        velocity: (C, 2) target velocity, cm a frame. direction: (C, 2) target facing. heading: (C, 2) facing
        now. gait: a name, a name for each character, shares (G,) or (C, G), or None to choose by speed.
        A target slower than STILL gives the gait "stand", or "walk" while the character steps on the spot to
        turn. If the caller names "crouch", its share is 1 as well. Shares that the caller gives are not
        changed. Raises ValueError for a wrong shape or for shares below 0 or above 1, UnknownName for a gait
        that the network does not have.
        """
        shares = self._shares
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        as_array = np.asarray(gait)
        if as_array.dtype.kind in "biuf":  # numbers, so these are shares and not names
            valid = (as_array >= 0) & (as_array <= 1)
            if as_array.shape not in (shares.shape, shares.shape[1:]) or not valid.all():
                what = f"gait shares have to be {shares.shape[1:]} or {shares.shape} numbers from 0 to 1"
                raise ValueError(f"{what}, not {as_array.tolist()}; order: {', '.join(self._gaits)}")
            shares[:] = as_array
            return shares
        names = [gait] * self.characters if gait is None or isinstance(gait, str) else gait
        if len(names) != self.characters:
            raise ValueError(f"{len(names)} gaits for {self.characters} characters: give one, or one each")
        shares[:] = 0.0
        for c, name in enumerate(names):
            if name is None:
                name = "jog" if speed[c] >= JOG_FROM else "walk"
            self.check_gait(name)
            if speed[c] < STILL:
                # The angle between both facings, from their cross product and their dot product.
                (x, z), (to_x, to_z) = heading[c], direction[c]
                steps = abs(np.arctan2(to_x * z - to_z * x, to_x * x + to_z * z)) > TURN_IN_PLACE
                shares[c, self._gaits["walk" if steps else "stand"]] = 1.0
                if name != "crouch":
                    continue
            shares[c, self._gaits[name]] = 1.0
        return shares

    def check_gait(self, name: Any) -> None:
        """Raise UnknownName if the network does not have this gait."""
        if name not in self._gaits:
            raise UnknownName("no gait", name, self._gaits)
