"""Checks and converts the targets that the caller gives: velocity, facing and gait of each character."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.runtime.caller_axes import Axes
from hobble.runtime.channel_values import UnknownName
from hobble.runtime.limits import JOG_FROM
from hobble.runtime.trajectory import STILL

# cm a frame, 18 m/s: largest target velocity, well above what is real. Sprinters reach 21 cm a frame.
FASTEST = 30.0
TURN_IN_PLACE = np.radians(20)  # a standing character steps around if it has to turn by more than this


class CallerTargets:
    """Converts the targets of C characters.

    gaits: names of the network's gaits. axes: the caller's. characters: C.
    """

    def __init__(self, gaits: Sequence[str], axes: Axes, characters: int) -> None:
        self.axes, self.characters = axes, characters
        self._gaits = {name: i for i, name in enumerate(gaits)}
        self._shares = np.zeros((characters, len(gaits)))

    def velocity(self, velocity: Any) -> Array:
        """Target velocities (C, 2), cm a frame.

        Raises ValueError for a speed above FASTEST, and where `on_the_ground` does.
        """
        target = self.on_the_ground("target_velocity", velocity, self.axes.points_in)
        if (fastest := np.hypot(target[:, 0], target[:, 1]).max()) > FASTEST:
            raise ValueError(
                f"target_velocity is {fastest:.4g} cm a frame, faster than a body can move: "
                f"{FASTEST:g} cm a frame at most ({FASTEST * 0.6:g} m/s at 60 frames a second)"
            )
        return target

    def facing(self, facing: Any) -> Array:
        """Directions (C, 2) to look in, of any length. Raises ValueError where `on_the_ground` does."""
        return self.on_the_ground("facing", facing, self.axes.directions_in)

    def on_the_ground(self, what: str, vector: Any, convert: Any) -> Array:
        """The caller's vectors as Hobble's x, z (C, 2). A vector of two components has no height.

        what: name of the vector for messages. convert: function from the caller's axes to Hobble's. Raises
        ValueError for a wrong shape or a number that is not finite.
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
            if self.axes.native:
                return np.array(np.broadcast_to(v, (self.characters, 2)), order="C")
            full = np.zeros((*v.shape[:-1], 3))
            full[..., [k for k in range(3) if k != "XYZ".index(self.axes.up)]] = v
            v = full
        if not self.axes.native:
            v = convert(v)
        return np.array(np.broadcast_to(v[..., ::2], (self.characters, 2)), order="C")

    def gait_shares(self, velocity: Array, direction: Array, heading: Array, gait: Any) -> Array:
        """Shares (C, G) of the gaits, from the caller's gait. The next call overwrites them.

        velocity: (C, 2) target, cm a frame. direction: (C, 2) target facing; heading: (C, 2) facing now.
        gait: a
        name, a name for each character, shares (G,) or (C, G), or None to choose by speed.
        """
        shares = self._shares
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        given = np.asarray(gait)
        if given.dtype.kind in "biuf":
            valid = (given >= 0) & (given <= 1)
            if given.shape not in (shares.shape, shares.shape[1:]) or not valid.all():
                raise ValueError(
                    f"gait shares have to be {shares.shape[1:]} or {shares.shape} numbers from 0 to 1, not "
                    f"{given.tolist()}; order: {', '.join(self._gaits)}"
                )
            shares[:] = given
            return shares
        names = [gait] * self.characters if gait is None or isinstance(gait, str) else gait
        if len(names) != self.characters:
            raise ValueError(f"{len(names)} gaits for {self.characters} characters")
        shares[:] = 0.0
        for c, name in enumerate(names):
            if name is None:
                name = "jog" if speed[c] >= JOG_FROM else "walk"
            self.check_gait(name)
            if speed[c] < STILL:
                shares[c, self._gaits["stand"]] = 1.0 - _turning(heading[c], direction[c])
                shares[c, self._gaits["walk"]] = 1.0 - shares[c, self._gaits["stand"]]
                if name != "crouch":
                    continue
            shares[c, self._gaits[name]] = 1.0
        return shares

    def check_gait(self, name: Any) -> None:
        """Raise UnknownName if the network does not have this gait."""
        if name not in self._gaits:
            raise UnknownName("no gait", name, self._gaits)


def _turning(heading: Array, direction: Array) -> float:
    """1 if a standing character has to step around to face `direction` (2,), else 0. heading: (2,) now."""
    x, z = heading
    angle = np.arctan2(direction[0] * z - direction[1] * x, direction[0] * x + direction[1] * z)
    return float(abs(angle) > TURN_IN_PLACE)
