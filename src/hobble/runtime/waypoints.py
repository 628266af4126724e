"""Target velocities that lead characters around a closed track of waypoints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hobble.core.compiled import njit
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

    Every character starts at the track's last waypoint and goes toward waypoint 0. characters: C. arrived:
    distance, in cm, within which a waypoint counts as reached. `places` (W, 2) are the positions of the
    waypoints. `reached` (C,) counts the waypoints that each character has reached. `off_path` (C,) is the
    distance, in cm, of each character from the line between the last reached waypoint and the next one.
    """

    def __init__(
        self, track: Sequence[Waypoint] = TRACK, characters: int = 1, arrived: float = ARRIVED
    ) -> None:
        if len(track) < 2:
            raise ValueError(f"a track needs at least two waypoints, not {len(track)}")
        self.track, self.arrived = tuple(track), arrived
        self.places = np.array([w.position for w in self.track], float)
        self._speeds = np.array([w.speed for w in self.track], float)
        self.reached = np.zeros(characters, int)
        self.off_path = np.zeros(characters)

    @property
    def start(self) -> tuple[Array, float]:
        """Position (2,), cm, where a lap starts, and the yaw from there toward waypoint 0, radians."""
        ahead = self.places[0] - self.places[-1]
        return self.places[-1].copy(), float(np.arctan2(ahead[0], ahead[1]))

    def copies(self, of: np.ndarray) -> Follower:
        """A follower whose character i is as far on the track as character of[i] of this one."""
        out = Follower(self.track, len(of), self.arrived)
        out.reached[:], out.off_path[:] = self.reached[of], self.off_path[of]
        return out

    def lead(self, position: Array) -> tuple[Array, list[Waypoint]]:
        """The velocity (C, 2), cm a frame, of each character toward its next waypoint, and these C waypoints.

        position: (C, 2) x and z of the characters, cm. Updates `reached` and `off_path`.
        """
        velocity = np.empty((len(position), 2))
        _lead(self.places, self._speeds, self.arrived, position, self.reached, self.off_path, velocity)
        return velocity, [self.track[n % len(self.track)] for n in self.reached.tolist()]


@njit
def _distance_to_segment(p: Any, a: Any, b: Any) -> float:
    """Distance of point p from the segment a to b, cm. All three are (2,)."""
    px, pz, bx, bz = p[0] - a[0], p[1] - a[1], b[0] - a[0], b[1] - a[1]
    # The nearest point of the segment is at the share t of the way from a to b.
    t = min(max((px * bx + pz * bz) / max(bx * bx + bz * bz, 1e-9), 0.0), 1.0)
    return np.sqrt((px - t * bx) ** 2 + (pz - t * bz) ** 2)


@njit
def _lead(
    places: Any, speeds: Any, arrived: float, position: Any, reached: Any, off_path: Any, velocity: Any
) -> None:
    """Write the velocities of `Follower.lead` into `velocity`, and update `reached` and `off_path`."""
    count = len(places)
    for c in range(position.shape[0]):
        n = reached[c] % count  # the next waypoint; x and z lead to it
        x, z = places[n, 0] - position[c, 0], places[n, 1] - position[c, 1]
        distance = np.sqrt(x * x + z * z)
        if distance < arrived:
            reached[c] += 1
            n = (n + 1) % count
            x, z = places[n, 0] - position[c, 0], places[n, 1] - position[c, 1]
            distance = np.sqrt(x * x + z * z)
        off_path[c] = _distance_to_segment(position[c], places[n - 1], places[n])
        scale = speeds[n] / max(distance, 1e-6)
        velocity[c, 0], velocity[c, 1] = x * scale, z * scale
