"""Laps of the waypoint track: how closely the character follows it, and the time of each step of a frame.

All laps are walked at the same time, each by its own character (module `laps`). To measure the times, one
character alone walks the beginning of each lap again (module `times`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from hobble.measures.inputs import MeasureInputs, Outcome, Row
from hobble.measures.responsivity import Options
from hobble.measures.responsivity.laps import FPS, walk_laps
from hobble.measures.responsivity.results import Lap, ModeResults, PieceResults, Responsivity, Spread
from hobble.measures.responsivity.times import milliseconds, timed_frames
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime.controller import STEPS
from hobble.runtime.options import Runtime
from hobble.runtime.waypoints import TRACK, Waypoint

STORED_PATHS = 5  # the paths of this many laps are stored


def measure_responsivity(
    network: Network,
    *,
    configuration: str,
    runtime: Runtime,
    laps: int,
    lap_seconds: float,
    laps_other_modes: int | None = None,
    modes: Sequence[str] | None = None,
    track: Sequence[Waypoint] = TRACK,
    done: Mapping[str, PieceResults] | None = None,
) -> Responsivity:
    """Laps of the track of Segerstedt (2021), in the phase mode of `runtime` and in other modes.

    laps: number of laps in the mode of `runtime`. lap_seconds: simulated time after which a lap ends, even if
    waypoints remain. laps_other_modes: number of laps in each other mode, at most `laps`; None: `laps`.
    modes: the phase modes to run in addition to that of `runtime`; by default all modes of the network. done:
    mode -> what `laps_of_mode` returned for it, if its laps have already been walked.

    The result is described in docs/artefacts.md. Its key `modes` has the laps and the summary of each mode.
    The laps and the summary of the mode of `runtime` are also at the top level. Only the values under
    "milliseconds" depend on the clock. `largest_turn_degrees` is the largest turn of a joint from one frame
    to the next as drawn, and `predicted_turn_degrees` is the largest turn as the network predicts it. In
    `turns_held_back` frames, the runtime let a joint turn less than predicted. `runs` are the paths of the
    first STORED_PATHS laps in the mode of `runtime`.
    """
    own = network.resolve_mode(runtime.mode)
    laps_of_others = min(laps, laps_other_modes or laps)
    of_mode = dict(done or {})
    for mode in dict.fromkeys((*map(network.resolve_mode, network.modes if modes is None else modes), own)):
        if mode not in of_mode:
            in_mode = runtime.model_copy(update={"mode": mode})
            count = laps if mode == own else laps_of_others
            of_mode[mode] = laps_of_mode(network, in_mode, count, lap_seconds, track)
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
        "laps_other_modes": laps_of_others,
        **of_mode[own]["laps"],
        "modes": [piece["laps"] for piece in of_mode.values()],
    }


def laps_of_mode(
    network: Network,
    runtime: Runtime,
    laps: int,
    lap_seconds: float,
    track: Sequence[Waypoint] = TRACK,
) -> PieceResults:
    """All laps in the mode of `runtime`. For the arguments see `measure_responsivity`."""
    longest = int(lap_seconds * FPS)
    times = timed_frames(network, runtime, laps, longest, track)
    walked = walk_laps(network, runtime, laps, longest, track)
    results: list[Lap] = [
        {**lap, "milliseconds": milliseconds(seconds)}
        for (lap, _), seconds in zip(walked, times, strict=True)
    ]
    entry: ModeResults = {
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
        "milliseconds": milliseconds(np.concatenate(times)),
    }
    return {"laps": entry, "runs": [run for _, run in walked[:STORED_PATHS]]}


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


def lap_rows(result: Responsivity) -> list[Row]:
    """The laps of every mode as rows for a CSV file. The last columns are the times and their spread."""
    rows: list[Row] = []
    for entry in result["modes"]:
        for lap in entry["laps"]:
            # Laps read from a file have sorted keys. The columns have the order of the fields of `Lap`.
            values: Row = {"mode": entry["mode"]} | lap
            row = {key: values[key] for key in ("mode", *Lap.__annotations__) if key != "milliseconds"}
            times: dict[str, Any] = {**lap["milliseconds"]}
            row |= {f"milliseconds_{key}": times[key] for key in (*STEPS, "total")}
            row |= {f"milliseconds_{key}_sd": times["sd"][key] for key in STEPS}
            rows.append(row | {f"milliseconds_{key}": times["spread"][key] for key in Spread.__annotations__})
    return rows


def run_piece(inputs: MeasureInputs, options: Options, piece: str) -> PieceResults:
    """The laps in one phase mode. piece: the name of the mode."""
    laps = options.laps if piece == inputs.runtime.mode else min(options.laps, options.laps_other_modes)
    runtime = inputs.runtime.model_copy(update={"mode": piece})
    return laps_of_mode(load_network(inputs.weights), runtime, laps, options.lap_seconds)


def run(inputs: MeasureInputs, options: Options) -> Outcome:
    """responsivity.json, and its laps as a table."""
    done: dict[str, Any] = inputs.measured_pieces()
    result = measure_responsivity(
        load_network(inputs.weights),
        configuration=inputs.configuration,
        runtime=inputs.runtime,
        laps=options.laps,
        lap_seconds=options.lap_seconds,
        laps_other_modes=options.laps_other_modes,
        modes=options.modes,
        done=done,
    )
    reached = [
        f"{m['mode']}: {m['waypoints_reached']} of {m['waypoints']} waypoints" for m in result["modes"]
    ]
    return Outcome(result, {"laps": lap_rows(result)}, "; ".join(reached))


def _segments(track: Sequence[Waypoint]) -> list[tuple[Waypoint, Waypoint]]:
    """The two ends of each segment of the closed track. The last segment ends at the first waypoint."""
    return list(zip(track, [*track[1:], track[0]], strict=True))


def _mean(values: list[float | None]) -> float | None:
    """The mean of the values that are not None; None if there are none."""
    known = [v for v in values if v is not None]
    return round(float(np.mean(known)), 4) if known else None
