"""Finds when each foot lands, and which heels and toes are on the ground, from the motion alone.

A foot lands at the end of a swing. It is down while its heel or its toe is slower than a limit. The limit
depends on how fast the foot swings. So it suits a slow shuffle, a jog in which the feet never quite rest, and
a dragged leg.
"""

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import median_of_three, true_runs
from hobble.labels.clip_labels import CONTACT_ROLES

RIGHT, LEFT = 0, 1
# A bout of walking is a time in which the feet land in turn, without a long rest. In a list of landings
# (frame, foot), this entry stands between two bouts.
END_OF_BOUT = (np.nan, -1)

# These limits were set on the hand-made labels of Holden et al. (2017) and on generated walks with exact
# landings. Frames are at 60 Hz. UNITS are the units of speed of a heel and of a toe, cm a frame. REST_SPEED
# has these units.
UNITS = np.array([0.75, 0.175] * 2)
REST_SPEED = 0.35  # a foot slower than this always rests
# A foot also rests if its speed is below this share of its top speed in a swing: in the slower of the two
# swings before and after the rest.
REST_OF_SWING = 0.12
# A dip in the speed separates two swings if it is at most REST_SPEED, or at most this share of the top speed
# in the slower of the two swings.
DIP_OF_SWING = 0.35
# A foot that never rests between two swings is down while its speed is less than this many times its lowest
# speed between these swings.
VALLEY = 2.875
SHORTEST_STEP = 2.5  # frames: a landing at most this long after the other foot's is left out
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


def find_swings(clip: Clip) -> list[Swing]:
    """The swings of both feet, in the order of their ends."""
    speed, relative = foot_speeds(clip), relative_speeds(clip)
    swings = []
    # Columns of the foot in `relative` (left, right) and of its toe in `speed` (CONTACT_ROLES).
    for foot, foot_column, toe_column in ((RIGHT, 1, 3), (LEFT, 0, 1)):
        for start, end in _swing_frames(relative[:, foot_column]):
            toe_speed = speed[start:end, toe_column]
            swings.append(Swing(foot, start, end, float(toe_speed.sum()), float(toe_speed.max())))
    real = sorted((s for s in swings if s.path_cm >= LEAST_PATH), key=lambda s: (s.end, s.foot))
    return _one_swing_per_step(real)


def relative_speeds(clip: Clip) -> Array:
    """(F, 2) speed of the left and of the right foot, without a unit, smoothed by a median of three frames.

    The speeds of heel and toe are divided by their UNITS. The speed of a foot is the lower of these two.
    """
    return median_of_three((foot_speeds(clip) / UNITS).reshape(-1, 2, 2).min(axis=2))


def find_landings(swings: list[Swing], frames: int) -> list[tuple[float, int]]:
    """Landings (frame, foot) in the order of the swings. END_OF_BOUT separates bouts of walking.

    A landing is later than the end of its swing, which is the first contact. The delay is the time in which
    the toe would move SETTLING_CM at the top speed of the swing. So it is longer after a slow swing. This
    agrees with hand-made labels, because people mark the frame in which the weight comes down.

    swings: of both feet, from `find_swings`. frames: length of the clip.
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
        if out and out[-1][1] == 1 - swing.foot and when - out[-1][0] <= SHORTEST_STEP:
            continue
        out.append((when, swing.foot))
    return out


def _swing_frames(relative: Array) -> np.ndarray:
    """(n, 2) the first frame in the air and the first frame down again, for each of n swings of a foot.

    relative: (F,) speed of the foot, a column of `relative_speeds`.
    """
    peaks = swing_peaks(relative)
    edges = true_runs(relative >= _rest_limit(relative, peaks))
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


def _rest_limit(relative: Array, peaks: np.ndarray) -> Array:
    """(F,) speed below which the foot is down, in the units of `relative`.

    Between two swings it depends on the peak of the slower swing. A foot that never rests between two swings
    is down while its speed is below VALLEY times its lowest speed between them, but always below 0.6
    times that peak. relative: (F,) speed of the foot. peaks: frames of the peaks, from `swing_peaks`.
    """
    limit = np.full(len(relative), REST_SPEED)
    for a, b in itertools.pairwise([0, *peaks, len(relative)]):
        if b <= a:
            continue
        peak = min((relative[p] for p in (a, b) if p in peaks), default=0.0)
        slowest = relative[a:b].min()
        limit[a:b] = max(REST_SPEED, REST_OF_SWING * peak)
        if slowest > limit[a] and peak:
            limit[a:b] = min(VALLEY * slowest, 0.6 * peak)
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


# Finds which heels and toes are on the ground.


FEET = ((0, 1), (2, 3))  # heel and toe of the left and of the right foot, in the order of CONTACT_ROLES


class Limits(NamedTuple):
    """When a joint is in contact. Each pair holds two limits: a joint comes into contact below the first one,
    and stays in contact below the second.

    heights: leg lengths above the height of the joint's stance. speeds: leg lengths a frame. swing_shares: a
    limit of speed is at least this share of the joint's speed in the middle of a swing: of the slower of the
    two swings before and after the stance. dip: leg lengths by which the stance may be lower than the median
    height of its slow frames: a captured toe that pushes off may dip some centimetres below the ground.
    """

    heights: tuple[float, float]
    speeds: tuple[float, float]
    swing_shares: tuple[float, float]
    dip: float


# For a leg of 80 cm, a heel comes into contact below 48 cm/s and 2.4 cm. So it is in contact for as long as
# it is slower than 60 cm/s and lower than 3 cm above its own floor, the median height of its slow frames
# within a second: to within .1 of the frames on 334 of 336 real clips. A toe rolls and pushes off, so it may
# be faster, and by as much as it swings. With these limits, a foot is down in the walks of `cmu` for 55 to
# 65 % of a cycle and for less than half of a jogging cycle.
HEEL = Limits((0.03, 0.035), (0.010, 0.013), (0.0, 0.0), 0.0)
TOE = Limits((0.02, 0.035), (0.010, 0.020), (0.18, 0.30), 0.016)
# Leg lengths. A person stands on tiptoe if the heel is this much higher above the toe than in the stances in
# which the foot is flattest. Then the heel is not in contact.
ON_TIPTOE = 0.05
# How flat a foot stands is measured while its heel and its toe are both down. A stance counts for at most
# MOST_COUNTED frames, so that one long rest does not outweigh all steps. FLATTER: the share of these frames
# in which a foot may be flatter than a flat foot, because a foot that lands on its heel has its toe up.
MOST_COUNTED, FLATTER = 15, 0.4
# Leg lengths. A person on one leg holds the other foot up: the hip is less than the first value above the
# heel of the raised foot, and more than the second value above the other heel.
DRAWN_UP, STRETCHED = 0.55, 0.8
STILL = 0.02  # cm2 a frame: the limit of Holden et al. (2017)


def find_still_joints(clip: Clip) -> np.ndarray:
    """(F, 4) bool: whether a joint moves less than the square root of STILL to the next frame.

    This is the rule of Holden et al. (2017). It ignores height, and depends on the size of the body and on
    the noise of the capture. The last frame has no next frame, so it repeats the value before it.
    """
    feet = foot_positions(clip)
    still = np.sum(np.diff(feet, axis=0) ** 2, axis=-1) < STILL
    if not len(still):
        return np.ones((len(feet), len(CONTACT_ROLES)), bool)
    return np.concatenate([still, still[-1:]])


def find_stance_contacts(clip: Clip) -> np.ndarray:
    """(F, 4) bool: whether a joint is slow and near the height of its stance.

    Between two swings a joint has one stance. The height of the stance is the median height of the joint in
    the slow frames between these swings, or their lowest height if this is at most `Limits.dip` lower. So the
    rule needs no floor, and works on slopes and stairs. Height and speed have two limits each (hysteresis):
    otherwise, a short movement would divide a stance into two. All limits are relative to leg length.
    """
    leg = clip.skeleton.leg_length
    # The mean of the speeds before and after a frame: one side alone would shift all stances by half a frame.
    after = foot_speeds(clip)
    speed = 0.5 * (np.concatenate([after[:1], after[:-1]]) + after) / leg
    height = foot_positions(clip)[..., 1] / leg
    out = np.zeros(speed.shape, bool)
    for (heel, toe), relative in zip(FEET, relative_speeds(clip).T, strict=True):
        edges = np.unique([0, *swing_peaks(relative), len(clip)])
        heel_level = _find_stances(height[:, heel], speed[:, heel], edges, HEEL, out[:, heel])
        toe_level = _find_stances(height[:, toe], speed[:, toe], edges, TOE, out[:, toe])
        heel_above_toe = heel_level - toe_level
        both_down = np.add.reduceat(out[:, heel] & out[:, toe], edges[:-1], dtype=int)
        counted = np.repeat(heel_above_toe, np.minimum(both_down, MOST_COUNTED))
        flat_foot = np.quantile(counted, FLATTER) if len(counted) else np.inf
        for number in np.flatnonzero(heel_above_toe > flat_foot + ON_TIPTOE):
            out[edges[number] : edges[number + 1], heel] = False
    return out & ~_joints_of_raised_foot(clip)


def _joints_of_raised_foot(clip: Clip) -> np.ndarray:
    """(F, 4) bool: whether a joint's leg is drawn up while the other leg is stretched."""
    sides = ("left", "right")
    hips, heels = (
        clip.positions[:, [clip.skeleton.role(f"{s}_{r}") for s in sides], 1] for r in ("hip", "heel")
    )
    reach = (hips - heels) / clip.skeleton.leg_length
    return np.repeat((reach < DRAWN_UP) & (reach[:, ::-1] > STRETCHED), 2, axis=1)


def _find_stances(height: Array, speed: Array, edges: np.ndarray, limits: Limits, down: np.ndarray) -> Array:
    """Find the S stances of a joint, and set `down` (F,) to True in their frames. Returns their heights (S,).

    height, speed: (F,) of the joint, in leg lengths and leg lengths a frame. edges: (S + 1,) the clip's ends
    and the fastest frame of each swing. Between each edge and the next there is one stance.
    """
    lands, stays = np.zeros(len(speed), bool), np.zeros(len(speed), bool)
    levels = []
    for a, b in itertools.pairwise(edges):
        swing_speed = min((speed[p] for p in (a, b) if 0 < p < len(speed)), default=0.0)
        landing, leaving = np.maximum(limits.speeds, np.multiply(limits.swing_shares, swing_speed))
        h, v = height[a:b], speed[a:b]
        slow = h[v <= max(landing, 1.2 * v.min())]  # never empty: it has at least the slowest frame
        levels.append(max(slow.min(), np.median(slow) - limits.dip))
        lands[a:b] = (h < levels[-1] + limits.heights[0]) & (v < landing)
        stays[a:b] = (h < levels[-1] + limits.heights[1]) & (v < leaving)
    down[:] = _stretches_with(stays | lands, lands)
    return np.array(levels)


def _stretches_with(stays: np.ndarray, lands: np.ndarray) -> np.ndarray:
    """(F,) bool: those stretches of successive True frames of `stays` in which `lands` is True at least once.

    stays, lands: (F,) bool.
    """
    number = np.cumsum(np.diff(stays, prepend=False) & stays)
    return stays & np.isin(number, number[lands & stays])
