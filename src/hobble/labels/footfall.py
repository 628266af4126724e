"""Finds when each foot lands, from the motion alone: a landing is the end of a swing.

A foot is down while its heel or its toe is slower than a limit. The limit depends on the options `heel_speed`
and `toe_speed` and on the swings of the foot. So it suits a slow shuffle, a jog in which the feet never quite
rest, and a dragged leg.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import median_of_three
from hobble.labels.clip_labels import CONTACT_ROLES
from hobble.labels.options import LabelOptions

RIGHT, LEFT = 0, 1
END_OF_BOUT = (np.nan, -1)  # stands between the landings (frame, foot) of two bouts of walking

# These limits were set on the hand-made labels of Holden et al. (2017) and on generated walks with exact
# landings. REST_SPEED is in units of the options `heel_speed` and `toe_speed`. Frames are at 60 Hz.
REST_SPEED = 0.35  # a foot slower than this always rests
# A foot also rests if its speed is below this share of the lower of two peaks: those of the swings before
# and after the rest.
REST_OF_SWING = 0.12
# A dip in the speed separates two swings if it is at most this share of the lower of their peaks.
DIP_OF_SWING = 0.35
LEAST_PATH = 6.0  # cm: a swing in which the toe moves less than this is dropped
SAME_SWING = 12  # frames: a rest of at most this length does not separate two swings of a foot
LESSER_SWING = 0.4  # of two successive swings of a foot, one shorter than this share of the other is no step
LONGEST_REST = 60  # frames: a longer rest of both feet ends a bout of walking
SETTLING_CM = 8.0  # cm that the toe moves between first contact and landing, see `landings`
LAST_FRAMES = 2  # a foot whose swing ends in this many last frames of the clip may not have landed


@dataclass(frozen=True)
class Swing:
    """A foot in the air from frame `start` until it is down at frame `end`.

    foot: RIGHT or LEFT. path: length of the toe's path, cm. peak: the toe's highest speed, cm a frame.
    """

    foot: int
    start: int
    end: int
    path: float
    peak: float


def foot_positions(clip: Clip) -> Array:
    """(F, 4, 3) positions of the joints in the order of CONTACT_ROLES, cm."""
    return clip.positions[:, [clip.skeleton.role(role) for role in CONTACT_ROLES]]


def foot_speeds(clip: Clip) -> Array:
    """(F, 4) speed of each joint from a frame to the next, cm a frame, in the order of CONTACT_ROLES."""
    feet = foot_positions(clip)
    if len(feet) < 2:
        return np.zeros(feet.shape[:2])
    speed = np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    return np.concatenate([speed, speed[-1:]])


def find_swings(clip: Clip, options: LabelOptions) -> list[Swing]:
    """The swings of both feet, in the order of their ends.

    options: `heel_speed` and `toe_speed` are the unit speeds. A foot that never rests between two swings is
    down while its speed is at most `valley_factor` times its lowest speed between these swings.
    """
    speed, relative = foot_speeds(clip), relative_speeds(clip, options)
    swings = []
    for foot, side, toe in ((RIGHT, 1, 3), (LEFT, 0, 1)):
        for start, end in _swing_frames(relative[:, side], options.valley_factor):
            path, peak = speed[start:end, toe].sum(), speed[start:end, toe].max()
            swings.append(Swing(foot, start, end, float(path), float(peak)))
    real = sorted((s for s in swings if s.path >= LEAST_PATH), key=lambda s: (s.end, s.foot))
    return _one_swing_a_step(real)


def relative_speeds(clip: Clip, options: LabelOptions) -> Array:
    """(F, 2) speed of the left and the right foot: that of its heel or of its toe, whichever is lower.

    The units are the options `heel_speed` and `toe_speed`.
    """
    speed = foot_speeds(clip)
    units = 2 * np.array([options.heel_speed, options.toe_speed] * 2)  # cm a frame at 60 Hz
    relative = (speed / units).reshape(-1, 2, 2).min(axis=2)
    return np.stack([median_of_three(side) for side in relative.T], axis=1)


def landings(swings: list[Swing], frames: int, shortest_step: float) -> list[tuple[float, int]]:
    """Landings (frame, foot) in the order of the swings. END_OF_BOUT separates bouts of walking.

    The frame of a landing is that of first contact, plus the time in which the toe would move SETTLING_CM at
    the top speed of the swing. So the landing is later after a slow swing, as in hand-made labels: people
    mark when the weight comes down. frames: length of the clip. shortest_step: a landing at most this many
    frames (at 120 Hz) after a landing of the other foot is left out.
    """
    out: list[tuple[float, int]] = []
    resting_since = -1
    for swing in swings:
        if swing.end >= frames - LAST_FRAMES:
            continue
        if out and swing.start - resting_since > LONGEST_REST:
            out.append(END_OF_BOUT)
        when = swing.end + SETTLING_CM / max(swing.peak, 1.5)
        resting_since = max(resting_since, swing.end)
        if out and out[-1][1] == 1 - swing.foot and when - out[-1][0] <= shortest_step / 2:
            continue
        out.append((when, swing.foot))
    return out


def _swing_frames(relative: Array, valley_factor: float) -> np.ndarray:
    """(n, 2) first frame in the air, and first frame down again, of each swing of a foot.

    relative: (F,) speed of the foot, a column of `relative_speeds`.
    """
    peaks = swing_peaks(relative)
    up = relative >= _rest_limit(relative, peaks, valley_factor)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], up, [False]]))).reshape(-1, 2)
    holds_peak = np.searchsorted(peaks, edges[:, 0]) < np.searchsorted(peaks, edges[:, 1])
    return edges[holds_peak]


def swing_peaks(relative: Array) -> np.ndarray:
    """The fastest frame of each swing of a foot: peaks of its speed, with a clear dip between any two.

    relative: (F,) speed of the foot, a column of `relative_speeds`.
    """
    kept: list[int] = []
    for peak in _local_highs(relative, 2 * REST_SPEED):
        while kept:
            lower = min(relative[kept[-1]], relative[peak])
            if relative[kept[-1] : peak + 1].min() <= max(REST_SPEED, DIP_OF_SWING * lower):
                kept.append(peak)
                break
            if relative[kept[-1]] >= relative[peak]:
                break
            kept.pop()
        else:
            kept.append(peak)
    return np.array(kept, int)


def _local_highs(values: Array, least: float) -> np.ndarray:
    """Frames of the local highs in `values` (F,) of at least `least`; for a plateau, its middle frame."""
    steps = np.diff(np.concatenate([[0.0], values, [0.0]]))
    moves = np.flatnonzero(steps)
    tops = np.flatnonzero((steps[moves[:-1]] > 0) & (steps[moves[1:]] < 0))
    frames = (moves[tops] + moves[tops + 1] - 1) // 2
    return frames[values[frames] >= least]


def _rest_limit(relative: Array, peaks: np.ndarray, valley_factor: float) -> Array:
    """(F,) speed below which the foot is down, in the units of `relative`.

    Between two swings it depends on the peak of the slower swing. relative: (F,) speed of the foot. peaks:
    frames of the peaks, from `swing_peaks`.
    """
    frames = len(relative)
    limit = np.full(frames, REST_SPEED)
    for a, b in itertools.pairwise([0, *peaks, frames]):
        if b <= a:
            continue
        peak = min((relative[p] for p in (a, b) if p in peaks), default=0.0)
        slowest = relative[a:b].min()
        limit[a:b] = max(REST_SPEED, REST_OF_SWING * peak)
        if slowest > limit[a] and peak:
            limit[a:b] = min(valley_factor * slowest, 0.6 * peak)
    return limit


def _one_swing_a_step(swings: list[Swing]) -> list[Swing]:
    """Join swings of a foot that are separated by a short rest, and drop small moves between steps."""
    out: list[Swing] = []
    for swing in swings:
        last = out[-1] if out else None
        if last is None or last.foot != swing.foot:
            out.append(swing)
            continue
        main = max(last, swing, key=lambda s: s.path)
        lesser = min(last.path, swing.path) < LESSER_SWING * main.path
        if swing.start - last.end <= SAME_SWING:
            end = last.end if lesser and main is last else swing.end
            peak = max(last.peak, swing.peak)
            out[-1] = Swing(swing.foot, last.start, end, last.path + swing.path, peak)
        elif lesser:
            out[-1] = main
        else:
            out.append(swing)
    return out
