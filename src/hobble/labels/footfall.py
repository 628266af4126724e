"""Where each foot lands, found from the motion alone: a foot that swings and then stays.

A foot is down while heel and toe are slow, by the two speeds of the facts page, or no faster than a factor
times what they are at the slowest moment between two swings, which is how a jogging or a dragged foot, which
never quite rests, is met. Landings of the right and the left foot then take turns.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.labels.contacts import foot_positions

RIGHT, LEFT = 0, 1
SHORTEST_STANCE = 3
LEAST_PATH = 8.0
SLOWEST_VALLEY = 4.0
LONGEST_REST = 60


@dataclass(frozen=True)
class Swings:
    """The n swings of one foot: it leaves at `start`, lands at `end`, and its toe goes `path` cm."""

    start: Array
    end: Array
    path: Array


def foot_speeds(clip: Clip) -> Array:
    """(F, 4) speeds in cm a frame to the next frame, in the order of CONTACT_ROLES."""
    feet = foot_positions(clip)
    if len(feet) < 2:
        return np.zeros(feet.shape[:2])
    speed = np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    return np.concatenate([speed, speed[-1:]])


def find_swings(heel: Array, toe: Array, heel_speed: float, toe_speed: float, valley_factor: float) -> Swings:
    """The swings of a foot with heel and toe speeds (F,), cm a frame.

    heel_speed, toe_speed: below both the foot is down (at 60 Hz). valley_factor: or below so many times the
    speed at a valley.
    """
    relative = np.maximum(heel / heel_speed, toe / toe_speed)
    limit = np.maximum(1.0, valley_factor * _valley(relative))
    up = _without_short(relative >= limit, SHORTEST_STANCE)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], up, [False]])))
    start, end = edges[::2], edges[1::2]
    path = np.array([toe[a:b].sum() for a, b in zip(start, end, strict=True)])
    real = path >= LEAST_PATH
    return Swings(start[real], end[real], path[real])


def find_landings(
    clip: Clip, heel_speed: float, toe_speed: float, valley_factor: float, shortest_step: int
) -> list[tuple[float, int]]:
    """Landings (frame, foot), foot 0 right and 1 left, taking turns; foot -1 ends a bout of steps.

    Speeds in cm a frame at 120 Hz and steps in frames at 120 Hz, as the facts page has them.
    """
    speed = foot_speeds(clip)
    swings = [
        find_swings(speed[:, h], speed[:, t], 2 * heel_speed, 2 * toe_speed, valley_factor)
        for h, t in ((2, 3), (0, 1))
    ]
    frames = len(clip)
    events = [
        (int(s), int(e), foot, float(p))
        for foot in (RIGHT, LEFT)
        for s, e, p in zip(swings[foot].start, swings[foot].end, swings[foot].path, strict=True)
        if e < frames
    ]
    return _taking_turns(sorted(events, key=lambda e: (e[1], e[2])), shortest_step / 2)


def _taking_turns(events: list[tuple[int, int, int, float]], shortest: float) -> list[tuple[float, int]]:
    landings: list[tuple[float, int]] = []
    resting_since = -1.0
    for start, end, foot, _ in events:
        if landings and start - resting_since > LONGEST_REST:
            landings.append((np.nan, -1))
        if landings and landings[-1][1] == 1 - foot and end - landings[-1][0] <= shortest:
            continue
        landings.append((float(end), foot))
        resting_since = max(resting_since, end)
    return landings


def _valley(relative: Array) -> Array:
    """(F,) for each frame the lowest value between the peaks around it, or 0 where no foot rests."""
    from scipy.signal import find_peaks

    peaks, _ = find_peaks(np.concatenate([[0.0], relative, [0.0]]), prominence=2.0)
    bounds = np.concatenate([[0], peaks - 1, [len(relative)]])
    out = np.zeros(len(relative))
    for a, b in itertools.pairwise(bounds):
        if b > a:
            least = relative[a:b].min()
            out[a:b] = least if least < SLOWEST_VALLEY else 0.0
    return out


def _without_short(up: Array, shortest: int) -> Array:
    """Runs of either value shorter than `shortest` frames take the value around them."""
    out = up.copy()
    for value in (False, True):
        edges = np.flatnonzero(np.diff(np.concatenate([[not value], out, [not value]]).astype(int)))
        for a, b in zip(edges[::2], edges[1::2], strict=True):
            if b - a < shortest and a > 0 and b < len(out):
                out[a:b] = not value
    return out
