"""Laps of the waypoint track: the time of each step of a frame, and how closely the track is followed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from time import perf_counter
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.evaluation.motion_measures import foot_slide, largest_turn
from hobble.measures.inputs import MeasureInputs, Outcome, Row
from hobble.measures.responsivity import Options
from hobble.measures.responsivity.results import (
    Lap,
    LapsOfMode,
    Milliseconds,
    OfMode,
    Responsivity,
    Run,
    Spread,
    Steps,
)
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation, world_rotations
from hobble.runtime.controller import STEPS
from hobble.runtime.options import Runtime
from hobble.runtime.waypoints import TRACK, Waypoint

FPS = 60
RUNS = 5  # laps whose path is stored
EVERY = 15  # frames between two stored places of a path
WARM_UP = 60  # frames before the first lap that are not measured, because compiled code is loaded in them


def responsivity(
    network: Network,
    *,
    configuration: str,
    runtime: Runtime,
    laps: int,
    lap_seconds: float,
    laps_other_modes: int | None = None,
    modes: Sequence[str] | None = None,
    track: Sequence[Waypoint] = TRACK,
    done: Mapping[str, LapsOfMode] | None = None,
) -> Responsivity:
    """Run the track of Segerstedt 2021: `laps` laps in the runtime's phase mode, fewer in other `modes`.

    laps_other_modes: laps in each other mode; by default, and at most, `laps`. modes: by default all modes of
    the network. done: mode -> its laps, if they have already been run (`laps_of_mode`). A lap that takes
    longer than `lap_seconds` of simulated time ends without its remaining waypoints, and the next lap starts
    from the beginning of the track.

    The result is described in docs/artefacts.md. `modes` has the laps and the summary of each mode; those of
    the runtime's own mode are also at the top level. Only the values under "milliseconds" depend on the
    clock. `largest_turn_degrees` is the largest turn of a joint from one frame to the next as drawn,
    `predicted_turn_degrees` the largest as predicted by the network; in `turns_held_back` frames the runtime
    let a joint turn less than predicted. `runs`: the paths of the first RUNS laps in the runtime's own mode.
    """
    own = network.mode(runtime.mode)
    fewer = min(laps, laps_other_modes or laps)
    found = dict(done or {})
    for mode in dict.fromkeys((*map(network.mode, network.modes if modes is None else modes), own)):
        if mode not in found:
            in_mode = runtime.model_copy(update={"mode": mode})
            found[mode] = laps_of_mode(network, in_mode, laps if mode == own else fewer, lap_seconds, track)
    return {
        "configuration": configuration,
        "track": {
            "waypoints": len(track),
            "metres": round(
                sum(np.hypot(*(np.subtract(a.position, b.position))) for a, b in _closed(track)) / 100, 3
            ),
            "gaits": [waypoint.gait for waypoint in track],
            "x": [waypoint.position[0] / 100 for waypoint in track],
            "z": [waypoint.position[1] / 100 for waypoint in track],
        },
        "runs": found[own]["runs"],
        "parameters": parameter_counts(network.sizes) if network.sizes else None,
        "stored": {mode: network.stored(mode) for mode in network.modes},
        "bytes_each": np.dtype(network.storage).itemsize,
        "exact": network.mode(None),
        "laps_other_modes": fewer,
        **found[own]["laps"],
        "modes": [each["laps"] for each in found.values()],
    }


def laps_of_mode(
    network: Network,
    runtime: Runtime,
    laps: int,
    lap_seconds: float,
    track: Sequence[Waypoint] = TRACK,
) -> LapsOfMode:
    """All laps in the mode of `runtime`. For the arguments see `responsivity`."""
    animation = ProceduralAnimation(network, waypoints=track, **dict(runtime))
    for _ in range(WARM_UP):
        animation.next_pose()
    animation.reset()
    results, times, runs = [], [], []
    for number in range(1, laps + 1):
        lap, seconds, run = _lap(animation, number, int(lap_seconds * FPS))
        results.append(lap)
        times.append(seconds)
        runs.append(run)
        if not lap["finished"]:
            animation.reset()
    entry: OfMode = {
        "mode": runtime.mode,
        "laps": results,
        "laps_finished": sum(lap["finished"] for lap in results),
        "waypoints_reached": sum(lap["waypoints_reached"] for lap in results),
        "waypoints": laps * len(track),
        "mean_lap_seconds": _mean([lap["seconds"] for lap in results if lap["finished"]]),
        "path_overshoot_cm": max(lap["path_overshoot_cm"] for lap in results),
        "foot_slide_cm": _mean([lap["foot_slide_cm"] for lap in results]),
        "largest_turn_degrees": max(lap["largest_turn_degrees"] for lap in results),
        "predicted_turn_degrees": max(lap["predicted_turn_degrees"] for lap in results),
        "turns_held_back": sum(lap["turns_held_back"] for lap in results),
        "milliseconds": _milliseconds(np.concatenate(times)),
    }
    return {"laps": entry, "runs": runs[:RUNS]}


def parameter_counts(sizes: Sequence[int]) -> dict[str, int]:
    """Weights and biases that one frame uses: as they are, and as Table 6.1 of Segerstedt counts them.

    sizes: units of each layer, from inputs to outputs. true: the actual number. table_6_1: by the formula of
    the table, the sum of n_l (1 + n_(l+1)) over the layers, plus n_out. table_6_1_as_printed: by that formula
    with one hidden layer fewer, as the thesis's text states the layers.

    >>> parameter_counts((342, 512, 512, 311))
    {'true': 597815, 'table_6_1': 598157, 'table_6_1_as_printed': 335501}
    """
    fewer = [sizes[0], *sizes[2:]]
    return {
        "true": sum(a * b + b for a, b in pairwise(sizes)),
        "table_6_1": sum(a * (1 + b) for a, b in pairwise(sizes)) + sizes[-1],
        "table_6_1_as_printed": sum(a * (1 + b) for a, b in pairwise(fewer)) + sizes[-1],
    }


def lap_rows(result: Responsivity) -> list[Row]:
    """The laps of every mode as rows for a CSV file. The last columns are the times and their deviations."""
    rows: list[Row] = []
    for entry in result["modes"]:
        for lap in entry["laps"]:
            # The keys of a piece come sorted from its file. The table has them in the order of the types.
            known: Row = {"mode": entry["mode"]} | lap
            row = {key: known[key] for key in ("mode", *Lap.__annotations__) if key != "milliseconds"}
            times: dict[str, Any] = {**lap["milliseconds"]}
            row |= {f"milliseconds_{key}": times[key] for key in (*STEPS, "total")}
            row |= {f"milliseconds_{key}_sd": times["sd"][key] for key in STEPS}
            rows.append(row | {f"milliseconds_{key}": times["spread"][key] for key in Spread.__annotations__})
    return rows


def run_piece(inputs: MeasureInputs, options: Options, piece: str) -> LapsOfMode:
    """The laps in one phase mode."""
    laps = options.laps if piece == inputs.runtime.mode else min(options.laps, options.laps_other_modes)
    runtime = inputs.runtime.model_copy(update={"mode": piece})
    return laps_of_mode(load_network(inputs.weights), runtime, laps, options.lap_seconds)


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """responsivity.json, and its laps as a table."""
    done: dict[str, Any] = inputs.measured_pieces()
    result = responsivity(
        load_network(inputs.weights),
        configuration=inputs.configuration,
        runtime=inputs.runtime,
        laps=options.laps,
        lap_seconds=options.lap_seconds,
        laps_other_modes=options.laps_other_modes,
        modes=options.modes,
        done=done,
    )
    says = [f"{m['mode']}: {m['waypoints_reached']} of {m['waypoints']} waypoints" for m in result["modes"]]
    return Outcome(result, {"laps": lap_rows(result)}, "; ".join(says))


def _lap(animation: ProceduralAnimation, number: int, longest: int) -> tuple[Lap, Array, Run]:
    """One lap; its times (F, steps + 1), seconds, the last of the whole call; and its path, see `_run`.

    longest: frames after which the lap is stopped.
    """
    follower, skeleton = animation.follower, animation.skeleton
    assert follower is not None
    toes = [skeleton.role("left_toe"), skeleton.role("right_toe")]
    start = int(follower.reached[0])
    goal = start + len(follower.track)
    positions, rotations, contacts, off = [], [], [], []
    turned, yaws, taken, places = [], [], [], []
    times: list[tuple[float, ...]] = []
    while follower.reached[0] < goal and len(times) < longest:
        before = perf_counter()
        pose = animation.next_pose()
        whole = perf_counter() - before
        times.append((*animation.seconds, whole))
        positions.append(pose.positions[toes])
        rotations.append(pose.rotations.astype(np.float32))
        turns, yaw = animation.predicted_turns
        turned.append(turns[0])
        yaws.append(yaw[0])
        taken.append(animation.state.joint_rotation[0].copy())
        contacts.append(pose.contacts)
        off.append(follower.off_path[0])
        places.append(np.array(pose.root)[[0, 2]])
    slide = foot_slide(np.array(positions), np.array(contacts))
    seconds = np.array(times)
    predicted = world_rotations(np.array(turned), np.array(yaws))
    lap: Lap = {
        "lap": number,
        "finished": bool(follower.reached[0] >= goal),
        "frames": len(times),
        "seconds": round(len(times) / FPS, 3),
        "waypoints_reached": int(follower.reached[0]) - start,
        "path_overshoot_cm": round(float(np.max(off)), 3),
        "path_distance_cm": round(float(np.mean(off)), 3),
        "foot_slide_cm": round(float(slide.mean()), 4) if len(slide) else None,
        "steps": len(slide),
        "largest_turn_degrees": round(largest_turn(np.array(rotations)), 3),
        "predicted_turn_degrees": round(largest_turn(predicted), 3),
        "turns_held_back": _held_back(predicted, np.array(taken)),
        "milliseconds": _milliseconds(seconds),
    }
    return lap, seconds, _run(number, np.array(places), np.array(off))


def _run(number: int, places: Array, off: Array) -> Run:
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


def _held_back(predicted: Array, taken: Array) -> int:
    """Number of frames in which the runtime limited the turn of a joint.

    predicted, taken: (F, J, 4) quaternions before and after the limit.
    """
    same = np.abs(np.sum(predicted * taken, axis=-1)) > 1 - 1e-6
    return int((~same).any(axis=1).sum()) if len(predicted) else 0


def _milliseconds(seconds: Array) -> Milliseconds:
    ms = 1000 * seconds
    total = ms[:, : len(STEPS)].sum(axis=1)
    return {
        **_of_steps(ms.mean(axis=0)),
        "total": round(float(total.mean()), 6),
        "sd": _of_steps(ms.std(axis=0)),
        "spread": {
            "sd": round(float(total.std()), 6),
            "median": round(float(np.median(total)), 6),
            "p99": round(float(np.percentile(total, 99)), 6),
            "whole_call": round(float(ms[:, -1].mean()), 6),
        },
    }


def _of_steps(values: Array) -> Steps:
    """Names the values of the steps. values: in the order of STEPS; later ones are ignored."""
    prepare, inputs, insert, predict, output, update = (round(float(v), 6) for v in values[: len(STEPS)])
    return {
        "prepare": prepare,
        "input": inputs,
        "insert": insert,
        "predict": predict,
        "output": output,
        "update": update,
    }


def _closed(track: Sequence[Waypoint]) -> list[tuple[Waypoint, Waypoint]]:
    return list(zip(track, [*track[1:], track[0]], strict=True))


def _mean(values: list[float | None]) -> float | None:
    known = [v for v in values if v is not None]
    return round(float(np.mean(known)), 4) if known else None
