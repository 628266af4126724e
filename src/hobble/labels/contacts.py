"""Finds which heels and toes are on the ground, from the motion of the feet alone."""

import itertools
from typing import NamedTuple

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.labels.clip_labels import CONTACT_ROLES
from hobble.labels.footfall import foot_positions, foot_speeds, relative_speeds, swing_peaks
from hobble.labels.options import LabelOptions

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


def find_contacts(clip: Clip, options: LabelOptions) -> np.ndarray:
    """(F, 4) bool: whether each joint of CONTACT_ROLES is on the ground, by the rule that `options` name."""
    if options.contacts == "original":
        return find_still_joints(clip, options.contact_threshold)
    return find_stance_contacts(clip, options)


def find_still_joints(clip: Clip, threshold: float) -> np.ndarray:
    """(F, 4) bool: whether a joint moves less than the square root of `threshold` (cm2) to the next frame.

    This is the rule of Holden et al. (2017). It ignores height, and depends on the size of the body and on
    the noise of the capture. The last frame has no next frame, so it repeats the value before it.
    """
    feet = foot_positions(clip)
    still = np.sum(np.diff(feet, axis=0) ** 2, axis=-1) < threshold
    if not len(still):
        return np.ones((len(feet), len(CONTACT_ROLES)), bool)
    return np.concatenate([still, still[-1:]])


def find_stance_contacts(clip: Clip, options: LabelOptions) -> np.ndarray:
    """(F, 4) bool: whether a joint is slow and near the height of its stance.

    Between two swings a joint has one stance. The height of the stance is the median height of the joint in
    the slow frames between these swings, or their lowest height if this is at most `Limits.dip` lower. So the
    rule needs no floor, and works on slopes and stairs. Height and speed have two limits each (hysteresis):
    otherwise, a short movement would divide a stance into two. All limits are relative to leg length.
    """
    leg = clip.skeleton.leg_length
    height, speed = foot_positions(clip)[..., 1] / leg, _centred_speeds(clip) / leg
    out = np.zeros(speed.shape, bool)
    for (heel, toe), relative in zip(FEET, relative_speeds(clip, options).T, strict=True):
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


def _centred_speeds(clip: Clip) -> Array:
    """(F, 4) speed of each joint of CONTACT_ROLES, cm a frame.

    It is the mean of the speeds before and after a frame. A speed from one side only would shift all stances
    by half a frame.
    """
    after = foot_speeds(clip)
    return 0.5 * (np.concatenate([after[:1], after[:-1]]) + after)
