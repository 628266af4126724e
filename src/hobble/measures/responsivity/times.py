"""The time of each step of a frame, measured on one character that walks alone."""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from hobble.core.quat import Array
from hobble.measures.responsivity.laps import FPS, starts_of
from hobble.measures.responsivity.results import Milliseconds, Steps
from hobble.models.network import Network
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.controller import STEPS
from hobble.runtime.options import Runtime
from hobble.runtime.waypoints import Waypoint

# Most frames that are timed: of each lap, and of all laps together.
OF_LAP, OF_ALL = 10 * FPS, 100 * FPS
WARM_UP = 60  # frames that are not measured, because compiled code is loaded in them


def timed_frames(
    network: Network, runtime: Runtime, laps: int, longest: int, track: Sequence[Waypoint]
) -> list[Array]:
    """For each lap, (F, steps + 1) seconds of its first F frames: of each step, and last of the whole call.

    The figures of `laps.walk_laps` walk one after another, each alone and from its own start. F is OF_LAP, an
    equal share of OF_ALL, or `longest`, whichever is least. A character alone does the same as in the crowd,
    to the last bit.
    """
    starts = starts_of(track, laps)
    animation = ProceduralAnimation(network, waypoints=track, **dict(runtime))
    for _ in range(WARM_UP):
        animation.next_pose()
    frames = max(1, min(OF_LAP, OF_ALL // laps, longest))
    out: list[Array] = []
    for lap in range(laps):
        starts.begin(animation, slice(lap, lap + 1))
        times = np.empty((frames, len(STEPS) + 1))
        for row in times:
            before = perf_counter()
            animation.next_pose()
            row[-1] = perf_counter() - before
            row[:-1] = animation.seconds
        out.append(times)
    return out


def milliseconds(seconds: Array) -> Milliseconds:
    """Means and standard deviations of the times (F, steps + 1) that `timed_frames` returns for one lap."""
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
