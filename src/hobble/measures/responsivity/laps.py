"""Laps of the waypoint track, walked by a crowd with one figure for each lap.

Lap 1 begins and ends at one waypoint, lap 2 at the next, and so on around the track. There are more laps than
waypoints, so in each further round the figures start farther before the waypoint where their lap begins. They
come to it at another moment of their gait and by a slightly different path, so no two laps are the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hobble.core.quat import Array
from hobble.evaluation.motion_measures import foot_slide, turns_between
from hobble.measures.responsivity.results import LapPath, LapWalk
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation, world_rotations
from hobble.runtime.options import Runtime
from hobble.runtime.waypoints import Waypoint

FPS = 60
EVERY = 15  # frames between two stored places of a path
AT_ONCE = 60  # frames whose rotations are in memory together
RUN_UP = 1000.0  # cm; figures start at most this far before the waypoint where their laps begin


@dataclass(frozen=True)
class Starts:
    """Where the figures of C laps start. places: (C, 2) cm. facing: (C, 2). waypoints: (C,) the next one."""

    places: Array
    facing: Array
    waypoints: np.ndarray

    def begin(self, animation: ProceduralAnimation, laps: slice) -> None:
        """Put the characters of `animation`, which follow the track, at the starts of some laps."""
        animation.reset(self.places[laps], self.facing[laps])
        assert animation.follower is not None
        animation.follower.reached[:] = self.waypoints[laps]


def starts_of(track: Sequence[Waypoint], laps: int) -> Starts:
    """The starts of `laps` laps. The first lap begins at the last waypoint of the track, the next at the
    first waypoint."""
    count = len(track)
    waypoints = (np.arange(laps) - 1) % count
    corners = np.array([waypoint.position for waypoint in track], float)
    ways = corners - np.roll(corners, 1, axis=0)  # way n leads to waypoint n
    lengths = np.hypot(ways[:, 0], ways[:, 1])
    rounds = -(-laps // count)
    ahead = np.arange(laps) // count / rounds * np.minimum(lengths, RUN_UP)[waypoints]
    places = corners[waypoints] - (ahead / np.maximum(lengths[waypoints], 1e-9))[:, None] * ways[waypoints]
    # A figure that stands at a waypoint has reached it, so it faces the one after it.
    facing = ways[np.where(ahead > 0, waypoints, (waypoints + 1) % count)]
    return Starts(places, facing, waypoints)


def walk_laps(
    network: Network, runtime: Runtime, laps: int, longest: int, track: Sequence[Waypoint]
) -> list[tuple[LapWalk, LapPath]]:
    """Walk `laps` laps, at most `longest` frames each. Returns how each went, and its path.

    A figure that does not come to its first waypoint in that time has reached none, and its lap begins where
    it starts.
    """
    starts = starts_of(track, laps)
    animation = ProceduralAnimation(network, characters=laps, waypoints=track, **dict(runtime))
    starts.begin(animation, slice(None))
    recorded = _record(animation, starts.waypoints + 1, longest)
    return [_lap(recorded, c, int(starts.waypoints[c]) + 1, len(track), longest) for c in range(laps)]


@dataclass(frozen=True)
class _Recorded:
    """F frames of C figures. Each is one array with these two axes first.

    toes: (F, C, 2, 3) cm. contacts: (F, C, 4). places: (F, C, 2) of the root on the ground, cm. off: cm from
    the track. reached: number of waypoints. drawn, predicted: degrees, the largest turn of a joint since the
    frame before (0 in the first). held: whether the runtime limited the turn of a joint.
    """

    toes: Array
    contacts: Array
    places: Array
    off: Array
    reached: np.ndarray
    drawn: Array
    predicted: Array
    held: np.ndarray


def _record(animation: ProceduralAnimation, first: np.ndarray, longest: int) -> _Recorded:
    """Walk until the laps of all figures are over. first: (C,) the value of `reached` at which laps begin."""
    follower, skeleton, count = animation.follower, animation.skeleton, animation.characters
    assert follower is not None
    goal = first + len(follower.track)
    toes = [skeleton.role("left_toe"), skeleton.role("right_toe")]
    kept: list[list[Array]] = [[], [], [], [], []]
    turns, since, frames = _Turns(), np.zeros(count, int), 0
    while True:
        begun = follower.reached >= first
        since[begun] += 1
        if np.all((follower.reached >= goal) | (since >= longest) | (~begun & (frames >= longest))):
            break
        pose = animation.next_pose()
        positions = pose.positions.reshape(count, -1, 3)
        now = (
            positions[:, toes],
            np.atleast_2d(pose.contacts),
            np.atleast_2d(pose.root)[:, ::2],
            follower.off_path.copy(),
            follower.reached.copy(),
        )
        for values, value in zip(kept, now, strict=True):
            values.append(value)
        turns.add(animation, pose.rotations.reshape(count, -1, 4))
        frames += 1
    of_toes, contacts, places, off, reached = (np.array(values) for values in kept)
    return _Recorded(of_toes, contacts, places, off, reached.astype(int), *turns.measured())


class _Turns:
    """The turns of joints from frame to frame. Only the rotations of AT_ONCE frames are kept."""

    def __init__(self) -> None:
        self._drawn: list[Array] = []
        self._taken: list[Array] = []
        self._predicted: list[tuple[Array, Array]] = []
        self._before: tuple[Array, Array] | None = None
        self._found: list[tuple[Array, Array, np.ndarray]] = []

    def add(self, animation: ProceduralAnimation, drawn: Array) -> None:
        """Add the last frame of C characters. drawn: (C, J, 4) rotations that the caller got."""
        self._drawn.append(drawn)
        self._taken.append(animation.state.joint_rotation.copy())
        self._predicted.append(animation.predicted_turns)
        if len(self._drawn) == AT_ONCE:
            self._measure()

    def measured(self) -> tuple[Array, Array, np.ndarray]:
        """The fields `drawn`, `predicted` and `held` of `_Recorded`."""
        if self._drawn:
            self._measure()
        drawn, predicted, held = (np.concatenate(parts) for parts in zip(*self._found, strict=True))
        return drawn, predicted, held

    def _measure(self) -> None:
        drawn = np.array(self._drawn)
        predicted = world_rotations(*(np.array(part) for part in zip(*self._predicted, strict=True)))
        before = self._before or (drawn[0], predicted[0])
        self._found.append(
            (
                turns_between(np.concatenate([before[0][None], drawn])),
                turns_between(np.concatenate([before[1][None], predicted])),
                held_back(predicted, np.array(self._taken)),
            )
        )
        self._before = drawn[-1], predicted[-1]
        self._drawn, self._taken, self._predicted = [], [], []


def held_back(predicted: Array, taken: Array) -> np.ndarray:
    """(...) whether the runtime limited the turn of any joint.

    predicted, taken: (..., J, 4) quaternions before and after the limit.
    """
    same = np.abs(np.sum(predicted * taken, axis=-1)) > 1 - 1e-6
    return np.asarray((~same).any(axis=-1))


def _lap(recorded: _Recorded, c: int, first: int, waypoints: int, longest: int) -> tuple[LapWalk, LapPath]:
    """Lap c + 1. first: the value of `reached` at which it begins; waypoints: of the track."""
    reached = recorded.reached[:, c]
    begin = int(np.searchsorted(reached, first))
    begin = 0 if begin == len(reached) else begin
    end = min(int(np.searchsorted(reached, first + waypoints)) + 1, begin + longest, len(reached))
    span, inside = slice(begin, end), slice(begin + 1, end)
    slide = foot_slide(recorded.toes[span, c], recorded.contacts[span, c])
    off, count = recorded.off[span, c], max(0, int(reached[end - 1]) - first)
    lap: LapWalk = {
        "lap": c + 1,
        "finished": count == waypoints,
        "frames": end - begin,
        "seconds": round((end - begin) / FPS, 3),
        "waypoints_reached": count,
        "path_overshoot_cm": round(float(np.max(off)), 3),
        "path_distance_cm": round(float(np.mean(off)), 3),
        "foot_slide_cm": round(float(slide.mean()), 4) if len(slide) else None,
        "steps": len(slide),
        "largest_turn_degrees": round(float(recorded.drawn[inside, c].max(initial=0.0)), 3),
        "predicted_turn_degrees": round(float(recorded.predicted[inside, c].max(initial=0.0)), 3),
        "turns_held_back": int(recorded.held[span, c].sum()),
    }
    return lap, _run(c + 1, recorded.places[span, c], off)


def _run(number: int, places: Array, off: Array) -> LapPath:
    """The path of a lap, with a place every EVERY frames.

    places: (F, 2), cm. off: (F,) distance from the line between waypoints, cm. A stored place has the largest
    distance since the stored place before it.
    """
    kept = range(0, len(places), EVERY)
    return {
        "lap": number,
        "seconds_between": EVERY / FPS,
        "x": np.round(places[kept, 0] / 100, 2).tolist(),
        "z": np.round(places[kept, 1] / 100, 2).tolist(),
        "off_cm": [round(float(off[max(0, f - EVERY + 1) : f + 1].max()), 1) for f in kept],
    }
