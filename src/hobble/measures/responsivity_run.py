"""Laps of the waypoint track: how closely the character follows it, and the time of each step of a frame.

All laps are walked at the same time, each by its own character. Lap 1 begins and ends at one waypoint, lap 2
at the next, and so on around the track. If there are more laps than waypoints, several laps begin at the same
waypoint. Their characters start at different distances before this waypoint. So they reach it at different
moments of their gait and by slightly different paths, and no two laps are the same.

To measure the times, one character alone walks each lap again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.files import Json
from hobble.core.quat import Array
from hobble.measures.measure import MeasureInputs, Outcome, Row
from hobble.measures.walks import FPS, foot_slide, mean_of_known, turns_between
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.controller import STEPS
from hobble.runtime.options import Runtime
from hobble.runtime.pose import world_rotations
from hobble.runtime.waypoints import TRACK, Waypoint

if TYPE_CHECKING:
    from hobble.measures.responsivity import Options

PATH_STEP = 15  # of a path, the place in every 15th frame is stored
STORED_PATHS = 5  # the paths of this many laps are stored
RUN_UP = 1000.0  # cm; a character starts at most this far before the waypoint where its lap begins
WARM_UP = 60  # the first frames are not measured, because compiled code is loaded in them
# The first columns of the table of laps, and the statistics of a frame's time that come last.
LAP_COLUMNS = (
    "lap",
    "finished",
    "frames",
    "seconds",
    "waypoints_reached",
    "path_overshoot_cm",
    "path_distance_cm",
    "foot_slide_cm",
    "steps",
    "largest_turn_degrees",
    "predicted_turn_degrees",
    "turns_held_back",
)
SPREAD = ("sd", "median", "p99", "whole_call")


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
) -> list[tuple[Json, Json, int]]:
    """Walk `laps` laps of at most `longest` frames.

    Returns how each lap went, its path, and how many frames its character walked before it began. If a
    character does not reach the waypoint where its lap begins within `longest` frames, its lap begins at the
    character's start, with no waypoint reached.
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
    joint, between the prediction and the placing of the feet, which gives the drawn rotation.
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
    recorded: list[tuple[Array, ...]] = []  # for each frame, the fields of `_Recorded`
    before: tuple[Array, Array] | None = None  # drawn and predicted rotations in the frame before
    lap_frames = np.zeros(count, int)
    while True:
        begun = follower.reached >= first
        lap_frames[begun] += 1
        # A lap is over at its goal or after `longest` frames, or if it has not begun after `longest` frames.
        late = ~begun & (len(recorded) >= longest)
        if np.all((follower.reached >= goal) | (lap_frames >= longest) | late):
            break
        pose = animation.next_pose()
        drawn = pose.rotations.reshape(count, -1, 4)
        predicted = world_rotations(*animation.predicted_turns)
        before = before or (drawn, predicted)
        recorded.append(
            (
                pose.positions.reshape(count, -1, 3)[:, toes],
                np.atleast_2d(pose.contacts),
                np.atleast_2d(pose.root)[:, ::2],
                follower.off_path.copy(),
                follower.reached.astype(int),
                turns_between(np.stack([before[0], drawn]))[0],
                turns_between(np.stack([before[1], predicted]))[0],
                turn_was_limited(predicted, animation.state.joint_rotation),
            )
        )
        before = drawn, predicted
    return _Recorded(*(np.array(values) for values in zip(*recorded, strict=True)))


def turn_was_limited(predicted: Array, limited: Array) -> np.ndarray:
    """(...) whether the runtime limited the turn of any joint.

    predicted, limited: (..., J, 4) quaternions before and after the runtime limits turns.
    """
    # The dot product of two unit quaternions is 1 or -1 if they are the same rotation.
    same = np.abs(np.sum(predicted * limited, axis=-1)) > 1 - 1e-6
    return np.asarray((~same).any(axis=-1))


def _measure_lap(
    recorded: _Recorded, c: int, first: int, waypoints: int, longest: int
) -> tuple[Json, Json, int]:
    """How the lap of character c went, its path, and its first frame.

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
    lap = {
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
    return lap, _path(c + 1, recorded.places[span, c], off_track), begin


def _path(lap: int, places: Array, off_track: Array) -> dict[str, Any]:
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


def timed_frames(
    network: Network, runtime: Runtime, spans: Sequence[tuple[int, int]], track: Sequence[Waypoint]
) -> list[Array]:
    """For each lap, (F, steps + 1) seconds: of each step in each of its frames, then of the whole call.

    The laps are those of `walk_laps`, but are walked one after another. A character alone does the same as
    among others, to the last bit. spans: for each lap, the number of frames before it and of its own frames.
    """
    starts = lap_starts(track, len(spans))
    animation = ProceduralAnimation(network, waypoints=track, **dict(runtime))
    for _ in range(WARM_UP):
        animation.next_pose()
    out: list[Array] = []
    for lap, (before, frames) in enumerate(spans):
        starts.place_characters(animation, slice(lap, lap + 1))
        for _ in range(before):
            animation.next_pose()
        times = np.empty((frames, len(STEPS) + 1))
        for row in times:
            began = perf_counter()
            animation.next_pose()
            row[-1] = perf_counter() - began
            row[:-1] = animation.seconds
        out.append(times)
    return out


def laps_in_mode(options: Options, mode: str, own: str) -> int:
    """The number of laps in a phase mode. own: that of the section `runtime`.

    There are as many in the mode `constant`, because the published times were measured in it.
    """
    return options.laps if mode in (own, "constant") else min(options.laps, options.laps_other_modes)


def milliseconds(seconds: Array) -> dict[str, Any]:
    """Statistics of frame times. seconds: (F, steps + 1), see `timed_frames`."""

    def of_steps(values: Array) -> dict[str, float]:
        return {step: round(float(v), 6) for step, v in zip(STEPS, values, strict=False)}

    ms = 1000 * seconds
    total = ms[:, : len(STEPS)].sum(axis=1)
    return {
        **of_steps(ms.mean(axis=0)),
        "total": round(float(total.mean()), 6),
        "sd": of_steps(ms.std(axis=0)),
        "spread": {
            "sd": round(float(total.std()), 6),
            "median": round(float(np.median(total)), 6),
            "p99": round(float(np.percentile(total, 99)), 6),
            "whole_call": round(float(ms[:, -1].mean()), 6),
        },
    }


def measure_responsivity(
    network: Network,
    options: Options,
    *,
    configuration: str,
    runtime: Runtime,
    track: Sequence[Waypoint] = TRACK,
    done: Mapping[str, Json] | None = None,
) -> dict[str, Any]:
    """Laps of the track of Segerstedt (2021), in the phase mode of `runtime` and in other modes.

    done: mode -> what `laps_of_mode` returned for it, if its laps have already been walked.

    The result is described in docs/artefacts.md. Its key `modes` has the laps and the summary of each mode.
    The laps and the summary of the mode of `runtime` are also at the top level. Only the values under
    "milliseconds" depend on the clock. `largest_turn_degrees` is the largest turn of a joint from one frame
    to the next as drawn, and `predicted_turn_degrees` is the largest turn as the network predicts it. In
    `turns_held_back` frames, the runtime let a joint turn less than predicted. `runs` are the paths of the
    first STORED_PATHS laps in the mode of `runtime`.
    """
    own = network.resolve_mode(runtime.mode)
    of_mode = dict(done or {})
    for mode in dict.fromkeys((*map(network.resolve_mode, options.modes), own)):
        if mode not in of_mode:
            in_mode = runtime.model_copy(update={"mode": mode})
            laps = laps_in_mode(options, mode, own)
            of_mode[mode] = laps_of_mode(network, in_mode, laps, options.lap_seconds, track)
    return {
        "configuration": configuration,
        "track": {
            "waypoints": len(track),
            "metres": round(
                sum(np.hypot(*(np.subtract(a.position, b.position))) for a, b in _segments(track)) / 100, 3
            ),
            "gaits": [waypoint.gait for waypoint in track],
            "x": [waypoint.position[0] / 100 for waypoint in track],
            "z": [waypoint.position[1] / 100 for waypoint in track],
        },
        "runs": of_mode[own]["runs"],
        "parameters": parameter_counts(network.sizes) if network.sizes else None,
        "stored": {mode: network.stored_numbers(mode) for mode in network.modes},
        "bytes_each": np.dtype(network.default_storage).itemsize,
        "exact": network.resolve_mode(None),
        "laps_other_modes": min(options.laps, options.laps_other_modes),
        **of_mode[own]["laps"],
        "modes": [piece["laps"] for piece in of_mode.values()],
    }


def laps_of_mode(
    network: Network,
    runtime: Runtime,
    laps: int,
    lap_seconds: float,
    track: Sequence[Waypoint] = TRACK,
) -> dict[str, Any]:
    """All laps in the mode of `runtime`. lap_seconds: simulated time after which a lap is stopped."""
    walked = walk_laps(network, runtime, laps, int(lap_seconds * FPS), track)
    times = timed_frames(network, runtime, [(before, lap["frames"]) for lap, _, before in walked], track)
    results = [
        {**lap, "milliseconds": milliseconds(seconds)}
        for (lap, *_), seconds in zip(walked, times, strict=True)
    ]
    entry = {
        "mode": runtime.mode,
        "laps": results,
        "laps_finished": sum(lap["finished"] for lap in results),
        "waypoints_reached": sum(lap["waypoints_reached"] for lap in results),
        "waypoints": laps * len(track),
        "mean_lap_seconds": mean_of_known([lap["seconds"] for lap in results if lap["finished"]], 4),
        "path_overshoot_cm": max(lap["path_overshoot_cm"] for lap in results),
        "foot_slide_cm": mean_of_known([lap["foot_slide_cm"] for lap in results], 4),
        "largest_turn_degrees": max(lap["largest_turn_degrees"] for lap in results),
        "predicted_turn_degrees": max(lap["predicted_turn_degrees"] for lap in results),
        "turns_held_back": sum(lap["turns_held_back"] for lap in results),
        "milliseconds": milliseconds(np.concatenate(times)),
    }
    return {"laps": entry, "runs": [path for _, path, _ in walked[:STORED_PATHS]]}


def parameter_counts(sizes: Sequence[int]) -> dict[str, int]:
    """Number of weights and biases that one frame uses, actual and as Table 6.1 of Segerstedt counts them.

    sizes: units of each layer, from inputs to outputs. true: the actual number. table_6_1: by the formula of
    the table, the sum of n_l (1 + n_(l+1)) over the layers, plus the number of outputs. table_6_1_as_printed:
    by the same formula without one of the hidden layers, because the text of the thesis states one hidden
    layer fewer than the network has.

    >>> parameter_counts((342, 512, 512, 311))
    {'true': 597815, 'table_6_1': 598157, 'table_6_1_as_printed': 335501}
    """
    without_a_layer = [sizes[0], *sizes[2:]]
    return {
        "true": sum(a * b + b for a, b in pairwise(sizes)),
        "table_6_1": sum(a * (1 + b) for a, b in pairwise(sizes)) + sizes[-1],
        "table_6_1_as_printed": sum(a * (1 + b) for a, b in pairwise(without_a_layer)) + sizes[-1],
    }


def lap_rows(result: Json) -> list[Row]:
    """The laps of every mode as rows for a CSV file. The last columns are the times and their spread."""
    rows: list[Row] = []
    for entry in result["modes"]:
        for lap in entry["laps"]:
            times = lap["milliseconds"]
            row = {"mode": entry["mode"], **{key: lap[key] for key in LAP_COLUMNS}}
            row |= {f"milliseconds_{key}": times[key] for key in (*STEPS, "total")}
            row |= {f"milliseconds_{key}_sd": times["sd"][key] for key in STEPS}
            rows.append(row | {f"milliseconds_{key}": times["spread"][key] for key in SPREAD})
    return rows


def run_piece(inputs: MeasureInputs, options: Options, piece: str) -> dict[str, Any]:
    """The laps in one phase mode. piece: the name of the mode."""
    runtime = inputs.runtime.model_copy(update={"mode": piece})
    laps = laps_in_mode(options, piece, inputs.runtime.mode)
    return laps_of_mode(load_network(inputs.weights), runtime, laps, options.lap_seconds)


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """responsivity.json, and its laps as a table."""
    result = measure_responsivity(
        load_network(inputs.weights),
        options,
        configuration=inputs.configuration,
        runtime=inputs.runtime,
        done=inputs.measured_pieces(),
    )
    reached = [
        f"{m['mode']}: {m['waypoints_reached']} of {m['waypoints']} waypoints" for m in result["modes"]
    ]
    return Outcome(result, {"laps": lap_rows(result)}, "; ".join(reached))


def _segments(track: Sequence[Waypoint]) -> list[tuple[Waypoint, Waypoint]]:
    """The two ends of each segment of the closed track. The last segment ends at the first waypoint."""
    return list(zip(track, [*track[1:], track[0]], strict=True))
