"""Finds which heels and toes are on the ground, from the motion of the feet alone."""

from __future__ import annotations

import itertools

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.labels.clip_labels import CONTACT_ROLES
from hobble.labels.footfall import foot_positions, relative_speeds, swing_peaks
from hobble.labels.options import LabelOptions

FEET = ((0, 1), (2, 3))  # heel and toe of the left and of the right foot, in the order of CONTACT_ROLES

# A joint comes into contact below the first limit of a pair and stays in contact below the second. Heights
# are above the height of the joint's stance, in leg lengths. A limit of speed is the larger of two values:
# SPEEDS, in leg lengths a frame, and SWING_SHARES times the joint's speed in the slower adjacent swing.
# Without SWING_SHARES, the stance of a dragged leg would not be found. All limits were set on the walks and
# runs of the data set `cmu`: there a foot is down for 55 to 65 % of a walking cycle and for less than half of
# a jogging cycle.
HEEL_HEIGHTS, TOE_HEIGHTS = (0.015, 0.02), (0.02, 0.035)
SPEEDS, SWING_SHARES = (0.010, 0.020), (0.18, 0.30)
# A captured toe that pushes off may dip some centimetres below its stance. So the height of a stance is at
# least the median height of its slow frames, minus this share of the first height limit.
DIP_SHARE = 0.8
# Leg lengths: a heel is in the air if it is this much higher above its toe than in the clip's flattest
# stances.
ON_TIPTOE = 0.03
# Heights of a hip above its heel, leg lengths. A foot is held up if this height is below the first
# value for its leg and above the second value for the other leg.
DRAWN_UP, STRETCHED = 0.55, 0.8


def contacts(clip: Clip, options: LabelOptions) -> np.ndarray:
    """(F, 4) bool in the order of CONTACT_ROLES, by the rule that the section `labels` selects."""
    if options.contacts == "original":
        return still_joints(clip, options.contact_threshold)
    return stance(clip, options)


def still_joints(clip: Clip, threshold: float) -> np.ndarray:
    """(F, 4) bool: whether a joint moves less than the root of `threshold` (cm2) to the next frame.

    This is the rule of Holden et al. (2017). It ignores height, and depends on the size of the body and on
    the noise of the capture. The last frame repeats the one before it.
    """
    feet = foot_positions(clip)
    still = np.sum(np.diff(feet, axis=0) ** 2, axis=-1) < threshold
    if not len(still):
        return np.ones((len(feet), len(CONTACT_ROLES)), bool)
    return np.concatenate([still, still[-1:]])


def stance(clip: Clip, options: LabelOptions) -> np.ndarray:
    """(F, 4) bool: whether a joint is slow and near the height of its stance.

    Between two swings a joint has one stance. The height of the stance is the joint's lowest height in slow
    frames there, so the rule needs no floor and works on slopes and stairs. Two limits each for height and
    speed (hysteresis) keep a stance in one piece from landing to toe-off. All limits are relative to leg
    length.
    """
    leg = clip.skeleton.leg_length
    height, speed = foot_positions(clip)[..., 1] / leg, _centred_speeds(clip) / leg
    out = np.zeros(speed.shape, bool)
    for (heel, toe), relative in zip(FEET, relative_speeds(clip, options).T, strict=True):
        edges = np.unique([0, *swing_peaks(relative), len(clip)])
        heel_level = _find_stances(height[:, heel], speed[:, heel], edges, HEEL_HEIGHTS, out[:, heel])
        toe_level = _find_stances(height[:, toe], speed[:, toe], edges, TOE_HEIGHTS, out[:, toe])
        lift = heel_level - toe_level
        whole = lift[1:-1] if len(lift) > 3 else lift  # the first and the last stance may be incomplete
        flat = np.percentile(whole, 10)
        for number in np.flatnonzero(lift > flat + ON_TIPTOE):
            out[edges[number] : edges[number + 1], heel] = False
    return out & ~_lifted(clip)


def _lifted(clip: Clip) -> np.ndarray:
    """(F, 4) bool: whether the joint's foot is held up: its leg drawn up, the other leg stretched."""
    sides = ("left", "right")
    hips, heels = (
        clip.positions[:, [clip.skeleton.role(f"{s}_{r}") for s in sides], 1] for r in ("hip", "heel")
    )
    reach = (hips - heels) / clip.skeleton.leg_length
    return np.repeat((reach < DRAWN_UP) & (reach[:, ::-1] > STRETCHED), 2, axis=1)


def _find_stances(
    height: Array, speed: Array, edges: np.ndarray, heights: tuple[float, float], down: np.ndarray
) -> Array:
    """Find the S stances of a joint and mark their frames in `down` (F,). Returns their heights (S,).

    height, speed: (F,) of the joint, in leg lengths and leg lengths a frame. edges: (S + 1,) the clip's ends
    and the fastest frame of each swing; there is one stance between each edge and the next. heights: limits
    of the height above a stance, for landing and for staying.
    """
    lands, stays = np.zeros(len(speed), bool), np.zeros(len(speed), bool)
    levels = []
    for a, b in itertools.pairwise(edges):
        swing = min((speed[p] for p in (a, b) if 0 < p < len(speed)), default=0.0)
        slow, leaves = (max(limit, share * swing) for limit, share in zip(SPEEDS, SWING_SHARES, strict=True))
        h, v = height[a:b], speed[a:b]
        still = h[v <= max(slow, 1.2 * v.min())]
        levels.append(max(still.min(), np.median(still) - DIP_SHARE * heights[0]))
        lands[a:b] = (h < levels[-1] + heights[0]) & (v < slow)
        stays[a:b] = (h < levels[-1] + heights[1]) & (v < leaves)
    down[:] = _stretches_with(stays | lands, lands)
    return np.array(levels)


def _stretches_with(stays: np.ndarray, lands: np.ndarray) -> np.ndarray:
    """The stretches of `stays` (F,) in which `lands` (F,) is true at least once."""
    number = np.cumsum(np.diff(stays, prepend=False) & stays)
    return stays & np.isin(number, number[lands & stays])


def _centred_speeds(clip: Clip) -> Array:
    """(F, 4) speeds, cm a frame: mean of the speeds to and from a frame, so that no stance is shifted."""
    feet = foot_positions(clip)
    if len(feet) < 2:
        return np.zeros(feet.shape[:2])
    steps = np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    return 0.5 * (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]]))
