"""Finds when each foot lands, from the motion alone. A foot lands at the end of a swing.

A foot is down while its heel or its toe is slower than a limit. The limit depends on the options `heel_speed`
and `toe_speed`, and on how fast the foot swings. So it suits a slow shuffle, a jog in which the feet never
quite rest, and a dragged leg.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import median_of_three, true_runs
from hobble.labels.clip_labels import CONTACT_ROLES
from hobble.labels.options import LabelOptions

RIGHT, LEFT = 0, 1
# A bout of walking is a time in which the feet land in turn, without a long rest. In a list of landings
# (frame, foot), this entry stands between two bouts.
END_OF_BOUT = (np.nan, -1)

# These limits were set on the hand-made labels of Holden et al. (2017) and on generated walks with exact
# landings. REST_SPEED is in units of the options `heel_speed` and `toe_speed`. Frames are at 60 Hz.
REST_SPEED = 0.35  # a foot slower than this always rests
# A foot also rests if its speed is below this share of its top speed in a swing: in the slower of the two
# swings before and after the rest.
REST_OF_SWING = 0.12
# A dip in the speed separates two swings if it is at most REST_SPEED, or at most this share of the top speed
# in the slower of the two swings.
DIP_OF_SWING = 0.35
LEAST_PATH = 6.0  # cm: a swing in which the toe moves less than this is dropped
SAME_SWING = 12  # frames: a rest of at most this length does not separate two swings of a foot
# If a foot swings twice, with no swing of the other foot between, and the path of one swing is shorter than
# this share of the other path, this swing is no step.
LESSER_SWING = 0.4
LONGEST_REST = 60  # frames: a longer rest of both feet ends a bout of walking
SETTLING_CM = 8.0  # how far the toe may move between first contact and landing, see `find_landings`
SLOWEST_PEAK = 1.5  # cm a frame: a swing with a lower peak is given this peak in `find_landings`
LAST_FRAMES = 2  # if a swing ends in this many last frames of the clip, the foot may not have landed


@dataclass(frozen=True)
class Swing:
    """A foot that is in the air from frame `start` on. At frame `end` it is down again.

    foot: RIGHT or LEFT. path_cm: length of the toe's path. peak_speed: the toe's highest speed, cm a
    frame.
    """

    foot: int
    start: int
    end: int
    path_cm: float
    peak_speed: float


def foot_positions(clip: Clip) -> Array:
    """(F, 4, 3) positions of the joints in the order of CONTACT_ROLES, cm."""
    return clip.positions[:, [clip.skeleton.role(role) for role in CONTACT_ROLES]]


def foot_speeds(clip: Clip) -> Array:
    """(F, 4) speed of each joint of CONTACT_ROLES from a frame to the next, cm a frame."""
    feet = foot_positions(clip)
    if len(feet) < 2:
        return np.zeros(feet.shape[:2])
    speed = np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    return np.concatenate([speed, speed[-1:]])


def find_swings(clip: Clip, options: LabelOptions) -> list[Swing]:
    """The swings of both feet, in the order of their ends.

    options: `heel_speed`, `toe_speed` and `valley_factor` are used.
    """
    speed, relative = foot_speeds(clip), relative_speeds(clip, options)
    swings = []
    # Columns of the foot in `relative` (left, right) and of its toe in `speed` (CONTACT_ROLES).
    for foot, foot_column, toe_column in ((RIGHT, 1, 3), (LEFT, 0, 1)):
        for start, end in _swing_frames(relative[:, foot_column], options.valley_factor):
            toe_speed = speed[start:end, toe_column]
            swings.append(Swing(foot, start, end, float(toe_speed.sum()), float(toe_speed.max())))
    real = sorted((s for s in swings if s.path_cm >= LEAST_PATH), key=lambda s: (s.end, s.foot))
    return _one_swing_per_step(real)


def relative_speeds(clip: Clip, options: LabelOptions) -> Array:
    """(F, 2) speed of the left and of the right foot, without a unit, smoothed by a median of three frames.

    The speed of a heel is divided by the option `heel_speed`, the speed of a toe by `toe_speed`. The speed of
    a foot is the lower of these two values.
    """
    speed = foot_speeds(clip)
    # The options are in cm per frame at 120 Hz. A frame at 60 Hz is twice as long.
    units = 2 * np.array([options.heel_speed, options.toe_speed] * 2)
    relative = (speed / units).reshape(-1, 2, 2).min(axis=2)
    return np.stack([median_of_three(side) for side in relative.T], axis=1)


def find_landings(swings: list[Swing], frames: int, shortest_step: float) -> list[tuple[float, int]]:
    """Landings (frame, foot) in the order of the swings. END_OF_BOUT separates bouts of walking.

    A landing is later than the end of its swing, which is the first contact. The delay is the time in which
    the toe would move SETTLING_CM at the top speed of the swing. So it is longer after a slow swing. This
    agrees with hand-made labels, because people mark the frame in which the weight comes down.

    swings: of both feet, from `find_swings`. frames: length of the clip. shortest_step: a landing at most
    this many frames (at 120 Hz) after a landing of the other foot is left out.
    """
    out: list[tuple[float, int]] = []
    resting_since = -1
    for swing in swings:
        if swing.end >= frames - LAST_FRAMES:
            continue
        if out and swing.start - resting_since > LONGEST_REST:
            out.append(END_OF_BOUT)
        when = swing.end + SETTLING_CM / max(swing.peak_speed, SLOWEST_PEAK)
        resting_since = max(resting_since, swing.end)
        if out and out[-1][1] == 1 - swing.foot and when - out[-1][0] <= shortest_step / 2:
            continue
        out.append((when, swing.foot))
    return out


def _swing_frames(relative: Array, valley_factor: float) -> np.ndarray:
    """(n, 2) the first frame in the air and the first frame down again, for each of n swings of a foot.

    relative: (F,) speed of the foot, a column of `relative_speeds`. valley_factor: the option.
    """
    peaks = swing_peaks(relative)
    up = relative >= _rest_limit(relative, peaks, valley_factor)
    edges = true_runs(up)
    holds_peak = np.searchsorted(peaks, edges[:, 0]) < np.searchsorted(peaks, edges[:, 1])
    return edges[holds_peak]


def swing_peaks(relative: Array) -> np.ndarray:
    """The frame of the highest speed in each swing of a foot, in order.

    Between two of these frames, the speed has a clear dip (see DIP_OF_SWING). relative: (F,) speed of the
    foot, a column of `relative_speeds`.
    """
    from scipy.signal import find_peaks  # imported here because most jobs do not need it

    peaks: list[int] = []
    # Local maxima, also in the first and last frame. A plateau gives its middle.
    for peak in find_peaks(np.pad(relative, 1), height=2 * REST_SPEED)[0] - 1:
        # Without a clear dip after the last peak, both belong to one swing, and only the higher one stays.
        while peaks:
            lower = min(relative[peaks[-1]], relative[peak])
            if relative[peaks[-1] : peak + 1].min() <= max(REST_SPEED, DIP_OF_SWING * lower):
                peaks.append(peak)
                break
            if relative[peaks[-1]] >= relative[peak]:
                break
            peaks.pop()
        else:
            peaks.append(peak)
    return np.array(peaks, int)


def _rest_limit(relative: Array, peaks: np.ndarray, valley_factor: float) -> Array:
    """(F,) speed below which the foot is down, in the units of `relative`.

    Between two swings it depends on the peak of the slower swing. A foot that never rests between two swings
    is down while its speed is below `valley_factor` times its lowest speed between them, but always below 0.6
    times that peak. relative: (F,) speed of the foot. peaks: frames of the peaks, from `swing_peaks`.
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


def _one_swing_per_step(swings: list[Swing]) -> list[Swing]:
    """Join swings of a foot that are separated by a short rest, and drop small movements that are no steps.

    swings: of both feet, in the order of their ends.
    """
    out: list[Swing] = []
    for swing in swings:
        last = out[-1] if out else None
        if last is None or last.foot != swing.foot:
            out.append(swing)
            continue
        longer = max(last, swing, key=lambda s: s.path_cm)
        one_is_small = min(last.path_cm, swing.path_cm) < LESSER_SWING * longer.path_cm
        if swing.start - last.end <= SAME_SWING:
            end = last.end if one_is_small and longer is last else swing.end
            peak = max(last.peak_speed, swing.peak_speed)
            out[-1] = Swing(swing.foot, last.start, end, last.path_cm + swing.path_cm, peak)
        elif one_is_small:
            out[-1] = longer
        else:
            out.append(swing)
    return out
