"""Laps of the waypoint track: how closely the character follows it, and the time of each step of a frame.

Lap 1 begins and ends at one waypoint, lap 2 at the next, and so on around the track. If there are more laps
than waypoints, several laps begin at the same waypoint. Their characters start at different distances before
this waypoint. So they reach it at different moments of their gait and by slightly different paths, and no two
laps are the same.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from hobble.core.files import Json
from hobble.core.quat import Array
from hobble.measures.measure import MeasureInputs, Outcome, flat_rows
from hobble.measures.walks import FPS, largest_turn, mean_of_known
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime import Runtime
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.controller import STEPS
from hobble.runtime.waypoints import TRACK, Waypoint

if TYPE_CHECKING:
    from hobble.measures.responsivity import Options

PATH_STEP = 15  # of a path, the place in every 15th frame is stored
STORED_PATHS = 5  # the paths of this many laps are stored
RUN_UP = 1000.0  # cm; a character starts at most this far before the waypoint where its lap begins
OTHER_LAPS = 3  # laps in other phase modes than that of the section `runtime`, to save time
WARM_UP = 60  # the first frames are not measured, because compiled code is loaded in them


def lap_starts(track: Sequence[Waypoint], laps: int) -> list[tuple[Array, Array, int]]:
    """Where the characters of `laps` laps start: place and facing direction (x and z, cm), and waypoint.

    A lap begins at this waypoint, given by its index in the track: the first lap at the last waypoint, the
    second lap at the first waypoint.
    """
    corners = np.array([waypoint.position for waypoint in track], float)
    ways = corners - np.roll(corners, 1, axis=0)  # way n leads to waypoint n
    lengths = np.hypot(*ways.T)
    rounds = -(-laps // len(track))  # the largest number of laps that begin at one waypoint
    starts = []
    for lap in range(laps):
        waypoint = (lap - 1) % len(track)
        # Laps that begin at the same waypoint start at evenly spaced distances before it.
        distance = lap // len(track) / rounds * min(lengths[waypoint], RUN_UP)
        place = corners[waypoint] - distance / max(lengths[waypoint], 1e-9) * ways[waypoint]
        # A character faces the waypoint where its lap begins, or the next one if it starts there.
        facing = ways[waypoint if distance > 0 else (waypoint + 1) % len(track)]
        starts.append((place, facing, waypoint))
    return starts


def walk_laps(
    network: Network, runtime: Runtime, laps: int, longest: int, track: Sequence[Waypoint]
) -> list[tuple[Json, Json, Array]]:
    """Walk `laps` laps of at most `longest` frames, one after another.

    Returns how each lap went, its path (x and z, m), and (F, steps) the seconds of each step of its frames.
    """
    animation = ProceduralAnimation(network, waypoints=track, **dict(runtime))
    for _ in range(WARM_UP):
        animation.next_pose()
    return [
        _walk_lap(animation, lap, *start, longest) for lap, start in enumerate(lap_starts(track, laps), 1)
    ]


def _walk_lap(
    animation: ProceduralAnimation, lap: int, place: Array, facing: Array, waypoint: int, longest: int
) -> tuple[Json, Json, Array]:
    """Walk one lap, see `walk_laps`. lap: its number. place, facing, waypoint: from `lap_starts`.

    The way to the waypoint where the lap begins does not belong to it. If the character does not get there
    within `longest` frames, its lap begins at the character's start, with no waypoint reached.
    """
    animation.reset(place, facing)
    follower = animation.follower
    assert follower is not None
    follower.reached[:] = waypoint
    first, waypoints = waypoint + 1, len(follower.track)
    recorded: list[tuple[Any, ...]] = []
    begin = None  # number of frames before the lap
    while True:
        reached = int(follower.reached[0])  # index of the next waypoint; after the last it goes on rising
        if begin is None and reached >= first:
            begin = len(recorded) - 1 if recorded else 0
        if reached >= first + waypoints or len(recorded) >= (begin or 0) + longest:
            break
        pose = animation.next_pose()
        off, now = float(follower.off_path[0]), int(follower.reached[0])
        recorded.append((pose.root[::2], pose.rotations, off, now, list(animation.seconds)))
    places, rotations, off_track, reached_at, times = map(np.array, zip(*recorded[begin or 0 :], strict=True))
    passed = max(0, int(reached_at[-1]) - first)
    result = {
        "lap": lap,
        "finished": passed == waypoints,
        "frames": len(places),
        "seconds": round(len(places) / FPS, 3),
        "waypoints_reached": passed,
        "path_overshoot_cm": round(float(np.max(off_track)), 3),
        "path_distance_cm": round(float(np.mean(off_track)), 3),
        "largest_turn_degrees": round(largest_turn(rotations), 3),
    }
    x, z = np.round(places[::PATH_STEP].T / 100, 2).tolist()
    return result, {"lap": lap, "x": x, "z": z}, times


def milliseconds(seconds: Array) -> dict[str, Any]:
    """Statistics of frame times. seconds: (F, steps), see `walk_laps`."""
    ms = 1000 * seconds
    median, p99 = np.percentile(ms.sum(axis=1), [50, 99])
    return {
        **{step: round(float(v), 6) for step, v in zip(STEPS, ms.mean(axis=0), strict=True)},
        "total": round(float(ms.sum(axis=1).mean()), 6),
        "spread": {"median": round(float(median), 6), "p99": round(float(p99), 6)},
    }


def measure_responsivity(
    network: Network,
    options: Options,
    *,
    configuration: str,
    runtime: Runtime,
    track: Sequence[Waypoint] = TRACK,
) -> dict[str, Any]:
    """Laps of the track of Segerstedt (2021), in the phase mode of `runtime` and in other modes.

    The result is described in docs/artefacts.md. Its key `modes` has the laps and the summary of each mode.
    The laps and the summary of the mode of `runtime` are also at the top level. Only the values under
    "milliseconds" depend on the clock. `largest_turn_degrees` is the largest turn of a joint from one frame
    to the next. `runs` are the paths of the first STORED_PATHS laps in the mode of `runtime`.
    """
    own = network.resolve_mode(runtime.mode)
    of_mode = {}
    for mode in dict.fromkeys((*map(network.resolve_mode, options.modes), own)):
        in_mode = runtime.model_copy(update={"mode": mode})
        # As many in the mode `constant`, because the published times were measured in it.
        laps = options.laps if mode in (own, "constant") else min(options.laps, OTHER_LAPS)
        of_mode[mode] = laps_of_mode(network, in_mode, laps, options.lap_seconds, track)
    places = [waypoint.position for waypoint in track]
    return {
        "configuration": configuration,
        "track": {
            "gaits": [waypoint.gait for waypoint in track],
            "x": [x / 100 for x, _ in places],
            "z": [z / 100 for _, z in places],
        },
        "runs": of_mode[own]["runs"],
        "parameters": parameter_counts(network.sizes) if network.sizes else None,
        "stored": {mode: network.stored_numbers(mode) for mode in network.modes},
        "bytes_each": np.dtype(network.default_storage).itemsize,
        "exact": network.resolve_mode(None),
        **of_mode[own]["laps"],
        "modes": [piece["laps"] for piece in of_mode.values()],
    }


def laps_of_mode(
    network: Network, runtime: Runtime, laps: int, lap_seconds: float, track: Sequence[Waypoint] = TRACK
) -> dict[str, Any]:
    """All laps in the mode of `runtime`. lap_seconds: simulated time after which a lap is stopped."""
    walked = walk_laps(network, runtime, laps, int(lap_seconds * FPS), track)
    results = [{**lap, "milliseconds": milliseconds(seconds)} for lap, _, seconds in walked]
    entry = {
        "mode": runtime.mode,
        "laps": results,
        "laps_finished": sum(lap["finished"] for lap in results),
        "waypoints_reached": sum(lap["waypoints_reached"] for lap in results),
        "waypoints": laps * len(track),
        "mean_lap_seconds": mean_of_known([lap["seconds"] for lap in results if lap["finished"]], 4),
        "path_overshoot_cm": max(lap["path_overshoot_cm"] for lap in results),
        "largest_turn_degrees": max(lap["largest_turn_degrees"] for lap in results),
        "milliseconds": milliseconds(np.concatenate([seconds for *_, seconds in walked])),
    }
    return {"laps": entry, "runs": [path for _, path, _ in walked[:STORED_PATHS]]}


def parameter_counts(sizes: Sequence[int]) -> dict[str, int]:
    """Number of weights and biases that one frame uses, actual and as Table 6.1 of Segerstedt counts them.

    sizes: units of each layer, from inputs to outputs. true: the actual number. table_6_1_as_printed: by the
    formula of the table, the sum of n_l (1 + n_(l+1)) over the layers, plus the number of outputs, without
    one of the hidden layers, because the text of the thesis states one hidden layer fewer than the network
    has.

    >>> parameter_counts((342, 512, 512, 311))
    {'true': 597815, 'table_6_1_as_printed': 335501}
    """
    without_a_layer = [sizes[0], *sizes[2:]]
    return {
        "true": sum(a * b + b for a, b in pairwise(sizes)),
        "table_6_1_as_printed": sum(a * (1 + b) for a, b in pairwise(without_a_layer)) + sizes[-1],
    }


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """responsivity.json, and its laps as a table."""
    result = measure_responsivity(
        load_network(inputs.weights), options, configuration=inputs.configuration, runtime=inputs.runtime
    )
    reached = [
        f"{m['mode']}: {m['waypoints_reached']} of {m['waypoints']} waypoints" for m in result["modes"]
    ]
    return Outcome(result, {"laps": flat_rows(result["modes"], "laps", "mode")}, "; ".join(reached))
