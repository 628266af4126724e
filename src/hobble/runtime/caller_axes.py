"""Converts between Hobble's axes and unit (right-handed, Y up, +Z forward, cm) and those of the caller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hobble.core.quat import Array

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
    """The caller's convention: handedness, up axis, unit of length.

    handed: whether the axes are right-handed or left-handed. In every convention, velocities are per frame at
    60 Hz, and quaternions have w first.
    """

    handed: Literal["right", "left"] = "right"
    up: Literal["Y", "Z"] = "Y"
    unit: Literal["cm", "m"] = "cm"

    def __post_init__(self) -> None:
        if (self.handed, self.up) not in MATRICES or self.unit not in UNITS:
            raise ValueError(
                f"{self}: handed has to be right or left, up has to be Y or Z, unit has to be cm or m"
            )

    @property
    def is_native(self) -> bool:
        """Whether this is Hobble's own convention. Then no conversion is needed."""
        return (self.handed, self.up, self.unit) == ("right", "Y", "cm")

    @property
    def matrix(self) -> Array:
        """(3, 3) matrix from Hobble's directions to the caller's. It swaps axes and changes signs."""
        return np.array(MATRICES[self.handed, self.up], float)

    @property
    def scale(self) -> float:
        """Length of one centimetre in the caller's unit."""
        return UNITS[self.unit]

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
