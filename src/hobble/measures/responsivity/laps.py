"""Laps of the waypoint track. Each lap has a character of its own; all characters walk at the same time.

Lap 1 begins and ends at one waypoint, lap 2 at the next, and so on around the track. If there are more laps
than waypoints, several laps begin at the same waypoint. Their characters start at different distances before
this waypoint. So they reach it at different moments of their gait and by slightly different paths, and no two
laps are the same.
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
PATH_STEP = 15  # of a path, the place in every 15th frame is stored
AT_ONCE = 60  # frames: the rotations of at most this many are in memory at the same time
RUN_UP = 1000.0  # cm; a character starts at most this far before the waypoint where its lap begins


@dataclass(frozen=True)
class LapStarts:
    """Where the characters of C laps start.

    places: (C, 2) x and z, cm. facing: (C, 2) direction in which the character looks. waypoints: (C,) index
    of the waypoint where the lap begins.
    """

    places: Array
    facing: Array
    waypoints: np.ndarray

    def place_characters(self, animation: ProceduralAnimation, laps: slice) -> None:
        """Put the characters of `animation` at the starts of the laps in the slice `laps`, one at each.

        The characters must follow the track.
        """
        animation.reset(self.places[laps], self.facing[laps])
        assert animation.follower is not None
        animation.follower.reached[:] = self.waypoints[laps]


def lap_starts(track: Sequence[Waypoint], laps: int) -> LapStarts:
    """The starts of `laps` laps.

    The first lap begins at the last waypoint of the track, the second lap at the first waypoint.
    """
    count = len(track)
    waypoints = (np.arange(laps) - 1) % count
    corners = np.array([waypoint.position for waypoint in track], float)
    ways = corners - np.roll(corners, 1, axis=0)  # way n leads to waypoint n
    lengths = np.hypot(ways[:, 0], ways[:, 1])
    # Laps that begin at the same waypoint start at evenly spaced distances before it.
    rounds = -(-laps // count)  # the largest number of laps that begin at one waypoint
    distances = np.arange(laps) // count / rounds * np.minimum(lengths, RUN_UP)[waypoints]
    places = (
        corners[waypoints] - (distances / np.maximum(lengths[waypoints], 1e-9))[:, None] * ways[waypoints]
    )
    # A character faces the waypoint where its lap begins, or the next one if it starts there.
    facing = ways[np.where(distances > 0, waypoints, (waypoints + 1) % count)]
    return LapStarts(places, facing, waypoints)


def walk_laps(
    network: Network, runtime: Runtime, laps: int, longest: int, track: Sequence[Waypoint]
) -> list[tuple[LapWalk, LapPath]]:
    """Walk `laps` laps of at most `longest` frames. Returns how each lap went, and its path.

    If a character does not reach the waypoint where its lap begins within `longest` frames, its lap begins at
    the character's start, with no waypoint reached.
    """
    starts = lap_starts(track, laps)
    animation = ProceduralAnimation(network, characters=laps, waypoints=track, **dict(runtime))
    starts.place_characters(animation, slice(None))
    recorded = _record(animation, starts.waypoints + 1, longest)
    return [_measure_lap(recorded, c, int(starts.waypoints[c]) + 1, len(track), longest) for c in range(laps)]


@dataclass(frozen=True)
class _Recorded:
    """F frames of C characters.

    toes: (F, C, 2, 3) positions of the toe joints, cm. contacts: (F, C, 4) of left heel, left toe, right
    heel, right toe. places: (F, C, 2) x and z of the root, cm. The other fields are (F, C). off_track:
    distance from the track, cm. reached: index of the next waypoint; after the last waypoint of the track it
    goes on rising. drawn_turn, predicted_turn: the largest turn of a joint since the frame before, as drawn
    and as predicted, degrees (0 in the first frame). limited: whether the runtime limited the turn of any
    joint.
    """

    toes: Array
    contacts: Array
    places: Array
    off_track: Array
    reached: np.ndarray
    drawn_turn: Array
    predicted_turn: Array
    limited: np.ndarray


def _record(animation: ProceduralAnimation, first: np.ndarray, longest: int) -> _Recorded:
    """Walk until the laps of all characters are over.

    first: (C,) value of `reached` with which each lap begins. longest: a lap lasts at most this many frames.
    """
    follower, skeleton, count = animation.follower, animation.skeleton, animation.characters
    assert follower is not None
    goal = first + len(follower.track)  # value of `reached` at the end of each lap
    toes = [skeleton.role("left_toe"), skeleton.role("right_toe")]
    recorded: list[list[Array]] = [[], [], [], [], []]  # for each value of `now`, the values of all frames
    turns, lap_frames, frames = _Turns(), np.zeros(count, int), 0
    while True:
        begun = follower.reached >= first
        lap_frames[begun] += 1
        # A lap is over at its goal or after `longest` frames, or if it has not begun after `longest` frames.
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
        for values, value in zip(recorded, now, strict=True):
            values.append(value)
        turns.add(animation, pose.rotations.reshape(count, -1, 4))
        frames += 1
    of_toes, contacts, places, off_track, reached = (np.array(values) for values in recorded)
    return _Recorded(of_toes, contacts, places, off_track, reached.astype(int), *turns.all_measured())


class _Turns:
    """The turns of joints from frame to frame, measured whenever AT_ONCE frames have been added.

    A joint has three rotations in a frame. The network predicts the first. The runtime limits the turn, which
    gives the second. It then places the feet, which gives the third, the drawn one.
    """

    def __init__(self) -> None:
        self._drawn: list[Array] = []
        self._limited: list[Array] = []
        self._predicted: list[tuple[Array, Array]] = []
        self._before: tuple[Array, Array] | None = None
        self._measured: list[tuple[Array, Array, np.ndarray]] = []

    def add(self, animation: ProceduralAnimation, drawn: Array) -> None:
        """Add the last frame of C characters. drawn: (C, J, 4) rotations of the drawn pose."""
        self._drawn.append(drawn)
        self._limited.append(animation.state.joint_rotation.copy())
        self._predicted.append(animation.predicted_turns)
        if len(self._drawn) == AT_ONCE:
            self._measure()

    def all_measured(self) -> tuple[Array, Array, np.ndarray]:
        """The fields `drawn_turn`, `predicted_turn` and `limited` of `_Recorded`, for all added frames."""
        if self._drawn:
            self._measure()
        drawn, predicted, limited = (np.concatenate(parts) for parts in zip(*self._measured, strict=True))
        return drawn, predicted, limited

    def _measure(self) -> None:
        """Measure the turns of the frames added since the last call, and forget their rotations."""
        drawn = np.array(self._drawn)
        predicted = world_rotations(*(np.array(part) for part in zip(*self._predicted, strict=True)))
        before = self._before or (drawn[0], predicted[0])
        self._measured.append(
            (
                turns_between(np.concatenate([before[0][None], drawn])),
                turns_between(np.concatenate([before[1][None], predicted])),
                turn_was_limited(predicted, np.array(self._limited)),
            )
        )
        self._before = drawn[-1], predicted[-1]
        self._drawn, self._limited, self._predicted = [], [], []


def turn_was_limited(predicted: Array, limited: Array) -> np.ndarray:
    """(...) whether the runtime limited the turn of any joint.

    predicted, limited: (..., J, 4) quaternions before and after the runtime limits turns.
    """
    # The dot product of two unit quaternions is 1 or -1 if they are the same rotation.
    same = np.abs(np.sum(predicted * limited, axis=-1)) > 1 - 1e-6
    return np.asarray((~same).any(axis=-1))


def _measure_lap(
    recorded: _Recorded, c: int, first: int, waypoints: int, longest: int
) -> tuple[LapWalk, LapPath]:
    """How the lap of character c went, and its path.

    first: the value of `reached` with which the lap begins. waypoints: number of waypoints of the track.
    longest: the lap lasts at most this many frames.
    """
    reached = recorded.reached[:, c]
    begin = int(np.searchsorted(reached, first))
    begin = 0 if begin == len(reached) else begin  # 0: the character never reached the lap's first waypoint
    end = min(int(np.searchsorted(reached, first + waypoints)) + 1, begin + longest, len(reached))
    # `turned` leaves out the lap's first frame, because its turn is since the frame before the lap.
    span, turned = slice(begin, end), slice(begin + 1, end)
    slides = foot_slide(recorded.toes[span, c], recorded.contacts[span, c])
    off_track, reached_in_lap = recorded.off_track[span, c], max(0, int(reached[end - 1]) - first)
    lap: LapWalk = {
        "lap": c + 1,
        "finished": reached_in_lap == waypoints,
        "frames": end - begin,
        "seconds": round((end - begin) / FPS, 3),
        "waypoints_reached": reached_in_lap,
        "path_overshoot_cm": round(float(np.max(off_track)), 3),
        "path_distance_cm": round(float(np.mean(off_track)), 3),
        "foot_slide_cm": round(float(slides.mean()), 4) if len(slides) else None,
        "steps": len(slides),
        "largest_turn_degrees": round(float(recorded.drawn_turn[turned, c].max(initial=0.0)), 3),
        "predicted_turn_degrees": round(float(recorded.predicted_turn[turned, c].max(initial=0.0)), 3),
        "turns_held_back": int(recorded.limited[span, c].sum()),
    }
    return lap, _path(c + 1, recorded.places[span, c], off_track)


def _path(lap: int, places: Array, off_track: Array) -> LapPath:
    """The path of a lap. The place in every PATH_STEP-th frame is stored.

    lap: its number. places: (F, 2) x and z, cm. off_track: (F,) distance from the track, cm. Each stored
    place has the largest distance since the stored place before it.
    """
    stored = range(0, len(places), PATH_STEP)
    return {
        "lap": lap,
        "seconds_between": PATH_STEP / FPS,
        "x": np.round(places[stored, 0] / 100, 2).tolist(),
        "z": np.round(places[stored, 1] / 100, 2).tolist(),
        "off_cm": [round(float(off_track[max(0, f - PATH_STEP + 1) : f + 1].max()), 1) for f in stored],
    }
