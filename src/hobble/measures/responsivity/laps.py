"""Laps of the waypoint track, walked by a crowd with one character for each lap.

Lap 1 begins and ends at one waypoint, lap 2 at the next, and so on around the track. If there are more laps
than waypoints, several laps begin at the same waypoint. Their characters start at different distances before
it, and reach it at different moments of their gait and by slightly different paths. So no two laps are the
same.
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
PATH_STEP = 15  # frames from one stored place of a path to the next
AT_ONCE = 60  # the rotations of at most this many frames are in memory together
RUN_UP = 1000.0  # cm; a character starts at most this far before the waypoint where its lap begins


@dataclass(frozen=True)
class Starts:
    """Where the characters of C laps start.

    places: (C, 2) x and z, cm. facing: (C, 2) direction. waypoints: (C,) index of the waypoint where the lap
    begins.
    """

    places: Array
    facing: Array
    waypoints: np.ndarray

    def begin(self, animation: ProceduralAnimation, laps: slice) -> None:
        """Put the characters of `animation`, which follow the track, at the starts of some laps."""
        animation.reset(self.places[laps], self.facing[laps])
        assert animation.follower is not None
        animation.follower.reached[:] = self.waypoints[laps]


def starts_of(track: Sequence[Waypoint], laps: int) -> Starts:
    """The starts of `laps` laps.

    The first lap begins at the last waypoint of the track, the second lap at the first waypoint.
    """
    count = len(track)
    waypoints = (np.arange(laps) - 1) % count
    corners = np.array([waypoint.position for waypoint in track], float)
    ways = corners - np.roll(corners, 1, axis=0)  # way n leads to waypoint n
    lengths = np.hypot(ways[:, 0], ways[:, 1])
    # Laps that begin at the same waypoint start at evenly spaced distances before it.
    rounds = -(-laps // count)
    distances = np.arange(laps) // count / rounds * np.minimum(lengths, RUN_UP)[waypoints]
    places = (
        corners[waypoints] - (distances / np.maximum(lengths[waypoints], 1e-9))[:, None] * ways[waypoints]
    )
    # A character that starts at its waypoint has already reached it, so it faces the next waypoint.
    facing = ways[np.where(distances > 0, waypoints, (waypoints + 1) % count)]
    return Starts(places, facing, waypoints)


def walk_laps(
    network: Network, runtime: Runtime, laps: int, longest: int, track: Sequence[Waypoint]
) -> list[tuple[LapWalk, LapPath]]:
    """Walk `laps` laps, at most `longest` frames each. Returns how each lap went, and its path.

    If a character does not reach the waypoint where its lap begins within `longest` frames, the lap is
    counted from the character's start, with no waypoint reached.
    """
    starts = starts_of(track, laps)
    animation = ProceduralAnimation(network, characters=laps, waypoints=track, **dict(runtime))
    starts.begin(animation, slice(None))
    recorded = _record(animation, starts.waypoints + 1, longest)
    return [_lap(recorded, c, int(starts.waypoints[c]) + 1, len(track), longest) for c in range(laps)]


@dataclass(frozen=True)
class _Recorded:
    """F frames of C characters.

    toes: (F, C, 2, 3) positions of the toe joints, cm. contacts: (F, C, 4) of heels and toes with the ground.
    places: (F, C, 2) x and z of the root, cm. The other fields are (F, C). off: distance from the track, cm.
    reached: number of waypoints reached so far, counted from waypoint 0 of the track. drawn, predicted: the
    largest turn of a joint since the frame before, as drawn and as predicted, degrees (0 in the first frame).
    held: whether the runtime limited the turn of a joint.
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
    """Walk until the laps of all characters are over.

    first: (C,) value of `reached` at which a lap begins. longest: a lap lasts at most this many frames.
    """
    follower, skeleton, count = animation.follower, animation.skeleton, animation.characters
    assert follower is not None
    goal = first + len(follower.track)
    toes = [skeleton.role("left_toe"), skeleton.role("right_toe")]
    kept: list[list[Array]] = [[], [], [], [], []]
    turns, lap_frames, frames = _Turns(), np.zeros(count, int), 0
    while True:
        begun = follower.reached >= first
        lap_frames[begun] += 1
        if np.all((follower.reached >= goal) | (lap_frames >= longest) | (~begun & (frames >= longest))):
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
    """The turns of joints from frame to frame, measured whenever AT_ONCE frames have been added.

    A rotation has three stages: predicted by the network, taken over by the runtime, which limits the turn,
    and drawn after the feet are placed.
    """

    def __init__(self) -> None:
        self._drawn: list[Array] = []
        self._taken: list[Array] = []
        self._predicted: list[tuple[Array, Array]] = []
        self._before: tuple[Array, Array] | None = None
        self._found: list[tuple[Array, Array, np.ndarray]] = []

    def add(self, animation: ProceduralAnimation, drawn: Array) -> None:
        """Add the last frame of C characters. drawn: (C, J, 4) rotations of the drawn pose."""
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
    """How lap c + 1 went, and its path.

    first: the value of `reached` at which the lap begins. waypoints: number of waypoints of the track.
    longest: the lap lasts at most this many frames.
    """
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
    return lap, _path(c + 1, recorded.places[span, c], off)


def _path(number: int, places: Array, off: Array) -> LapPath:
    """The path of a lap, of which one place in PATH_STEP frames is stored.

    places: (F, 2), cm. off: (F,) distance from the line between waypoints, cm. Each stored place has the
    largest distance since the stored place before it.
    """
    kept = range(0, len(places), PATH_STEP)
    return {
        "lap": number,
        "seconds_between": PATH_STEP / FPS,
        "x": np.round(places[kept, 0] / 100, 2).tolist(),
        "z": np.round(places[kept, 1] / 100, 2).tolist(),
        "off_cm": [round(float(off[max(0, f - PATH_STEP + 1) : f + 1].max()), 1) for f in kept],
    }
