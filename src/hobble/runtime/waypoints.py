"""Target velocities that lead characters around a closed track of waypoints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hobble.core.quat import Array


@dataclass(frozen=True)
class Waypoint:
    """A ground position x, z in cm, with the gait and speed (cm a frame) on the way to it.

    facing: world direction (x, z), of any length, in which the character looks on the way; None: it looks
    toward the waypoint.
    """

    position: tuple[float, float]
    gait: str
    speed: float
    facing: tuple[float, float] | None = None


# The track of Segerstedt (2021), who gives the positions in metres.
TRACK = (
    Waypoint((-3000.0, 4000.0), "walk", 2.5),
    Waypoint((-5000.0, 0.0), "walk", 2.5, (-0.5, -0.5)),
    Waypoint((-2500.0, -2500.0), "jog", 10.5),
    Waypoint((2500.0, -4000.0), "jog", 10.5),
    Waypoint((1000.0, -1000.0), "crouch", 2.0),
    Waypoint((2500.0, 5000.0), "walk", 2.5, (0.0, -1.0)),
)
ARRIVED = 100.0  # cm: a waypoint counts as reached within this distance


class Follower:
    """Makes C characters follow a closed track of W waypoints, each character at its own pace.

    Every character starts at the track's last waypoint and goes toward waypoint 0. characters: C. `places`
    (W, 2) are the positions of the waypoints. `reached` (C,) counts the waypoints that each character has
    reached. `off_path` (C,) is the distance, in cm, of each character from the line between the last reached
    waypoint and the next one.
    """

    def __init__(self, track: Sequence[Waypoint] = TRACK, characters: int = 1) -> None:
        if len(track) < 2:
            raise ValueError(f"a track needs at least two waypoints, not {len(track)}")
        self.track = tuple(track)
        self.places = np.array([w.position for w in self.track], float)
        self._speeds = np.array([w.speed for w in self.track], float)
        self._facings = np.array([w.facing or (0.0, 0.0) for w in self.track], float)
        self.reached = np.zeros(characters, int)
        self.off_path = np.zeros(characters)

    @property
    def start(self) -> tuple[Array, float]:
        """Position (2,), cm, where a lap starts, and the yaw from there toward waypoint 0, radians."""
        ahead = self.places[0] - self.places[-1]
        return self.places[-1].copy(), float(np.arctan2(ahead[0], ahead[1]))

    def lead(self, position: Array) -> tuple[Array, Array, list[str]]:
        """The velocity (C, 2), cm a frame, of each character toward its next waypoint, its facing, its gait.

        A facing (C, 2) of zero is the direction of movement. position: (C, 2) x and z of the characters, cm.
        Updates `reached` and `off_path`.
        """
        count = len(self.track)
        ahead = self.places[self.reached % count] - position
        self.reached += np.sqrt(np.sum(ahead * ahead, axis=1)) < ARRIVED
        n = self.reached % count  # the next waypoint of each character
        ahead, way = self.places[n] - position, self.places[n] - self.places[n - 1]
        # The nearest point of the line from the last waypoint is at the share t of the way to the next.
        behind = position - self.places[n - 1]
        t = np.sum(behind * way, axis=1) / np.maximum(np.sum(way * way, axis=1), 1e-9)
        off = behind - np.clip(t, 0.0, 1.0)[:, None] * way
        self.off_path[:] = np.sqrt(np.sum(off * off, axis=1))
        distance = np.sqrt(np.sum(ahead * ahead, axis=1))
        velocity = ahead * (self._speeds[n] / np.maximum(distance, 1e-6))[:, None]
        return velocity, self._facings[n], [self.track[i].gait for i in n.tolist()]
