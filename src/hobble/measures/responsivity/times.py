"""The time of each step of a frame, measured on one character that walks alone."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from hobble.core.quat import Array
from hobble.measures.responsivity.laps import FPS, lap_starts
from hobble.measures.responsivity.results import Milliseconds, Steps
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.controller import STEPS
from hobble.runtime.options import Runtime
from hobble.runtime.waypoints import Waypoint

# The largest numbers of frames that are timed: in each lap, and in all laps together.
TIMED_OF_LAP, TIMED_OF_ALL = 10 * FPS, 100 * FPS
WARM_UP = 60  # the first frames are not measured, because compiled code is loaded in them


def timed_frames(
    network: Network, runtime: Runtime, laps: int, longest: int, track: Sequence[Waypoint]
) -> list[Array]:
    """For each lap, (F, steps + 1) seconds: of each step in its first F frames, then of the whole call.

    The laps begin as in `hobble.measures.responsivity.laps.walk_laps`, but are walked one after another, with
    one character at a time. A character alone does the same as among others, to the last bit. longest: the
    largest number of frames of a lap. F is the least of three numbers: TIMED_OF_LAP, `longest`, and
    TIMED_OF_ALL divided by the number of laps.
    """
    starts = lap_starts(track, laps)
    animation = ProceduralAnimation(network, waypoints=track, **dict(runtime))
    for _ in range(WARM_UP):
        animation.next_pose()
    frames = max(1, min(TIMED_OF_LAP, TIMED_OF_ALL // laps, longest))
    out: list[Array] = []
    for lap in range(laps):
        starts.place_characters(animation, slice(lap, lap + 1))
        times = np.empty((frames, len(STEPS) + 1))
        for row in times:
            before = perf_counter()
            animation.next_pose()
            row[-1] = perf_counter() - before
            row[:-1] = animation.seconds
        out.append(times)
    return out


def milliseconds(seconds: Array) -> Milliseconds:
    """Statistics of frame times. seconds: (F, steps + 1), see `timed_frames`."""
    ms = 1000 * seconds
    total = ms[:, : len(STEPS)].sum(axis=1)
    return {
        **_named_steps(ms.mean(axis=0)),
        "total": round(float(total.mean()), 6),
        "sd": _named_steps(ms.std(axis=0)),
        "spread": {
            "sd": round(float(total.std()), 6),
            "median": round(float(np.median(total)), 6),
            "p99": round(float(np.percentile(total, 99)), 6),
            "whole_call": round(float(ms[:, -1].mean()), 6),
        },
    }


def _named_steps(values: Array) -> Steps:
    """Step -> its value. values: in the order of STEPS; further values are ignored."""
    prepare, inputs, insert, predict, output, update = (round(float(v), 6) for v in values[: len(STEPS)])
    return {
        "prepare": prepare,
        "input": inputs,
        "insert": insert,
        "predict": predict,
        "output": output,
        "update": update,
    }
