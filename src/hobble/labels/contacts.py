"""Which heels and toes stand on the ground, from the motion of the feet alone."""

from __future__ import annotations

import itertools

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.labels.footfall import foot_positions, relative_speeds, swing_peaks
from hobble.labels.model import CONTACT_ROLES
from hobble.labels.options import Labels

FEET = ((0, 1), (2, 3))  # heel and toe of the left and of the right foot, in the order of CONTACT_ROLES

# A joint comes into contact below LANDS and stays in contact up to LEAVES: its height above the stance, in
# leg lengths, and its speed, in leg lengths a frame or as a share of the fastest moment of the swing beside
# it, whichever is more. The share keeps the stance of a leg that is dragged. Set on the walks and runs of
# `cmu`: a foot is then down for 55 to 65 % of a walking cycle and for less than half of a jogging one.
LANDS_HEIGHT, LEAVES_HEIGHT = 0.03, 0.06
LANDS_SPEED, LEAVES_SPEED = 0.010, 0.020
LANDS_SHARE, LEAVES_SHARE = 0.18, 0.30


def contacts(clip: Clip, options: Labels) -> np.ndarray:
    """(F, 4) bool in the order of CONTACT_ROLES, by the rule that the section `labels` names."""
    if options.contacts == "original":
        return still_joints(clip, options.contact_threshold)
    return stance(clip, options)


def still_joints(clip: Clip, threshold: float) -> np.ndarray:
    """(F, 4) bool: whether a joint moves less than the root of `threshold` (cm2) to the next frame.

    This is the rule of the original (`pfnn-facts`, Labels): it does not look at height, and it depends on the
    size of the body and on the noise of the capture. The last frame repeats the one before it.
    """
    feet = foot_positions(clip)
    still = np.sum(np.diff(feet, axis=0) ** 2, axis=-1) < threshold
    if not len(still):
        return np.ones((len(feet), len(CONTACT_ROLES)), bool)
    return np.concatenate([still, still[-1:]])


def stance(clip: Clip, options: Labels) -> np.ndarray:
    """(F, 4) bool: whether a joint is near the height of its stance and slow.

    Between two swings a foot has one stance, and its height is the lowest of the joint's slow frames there.
    So the rule needs no floor and holds on slopes and stairs. Two pairs of limits (hysteresis) keep a stance
    in one piece from landing to toe-off. All limits are relative to the length of the leg.
    """
    leg = clip.skeleton.leg_length
    feet, speed = foot_positions(clip), _centred_speeds(clip)
    out = np.zeros(speed.shape, bool)
    for (heel, toe), relative in zip(FEET, relative_speeds(clip, options).T, strict=True):
        peaks = swing_peaks(relative)
        for joint in (heel, toe):
            height = feet[:, joint, 1] / leg
            out[:, joint] = _stance_of_joint(height, speed[:, joint] / leg, peaks)
    return out


def _stance_of_joint(height: Array, speed: Array, peaks: np.ndarray) -> np.ndarray:
    """(F,) bool of a joint with `height` and `speed` (F,) in leg lengths; its foot is fastest at `peaks`."""
    lands, stays = np.zeros(len(speed), bool), np.zeros(len(speed), bool)
    for a, b in itertools.pairwise([0, *peaks, len(speed)]):
        if b <= a:
            continue
        swing = min((speed[p] for p in (a, b) if p in peaks), default=0.0)
        slow = max(LANDS_SPEED, LANDS_SHARE * swing)
        h, v = height[a:b], speed[a:b]
        level = h[v <= max(slow, 1.2 * v.min())].min()
        lands[a:b] = (h < level + LANDS_HEIGHT) & (v < slow)
        stays[a:b] = (h < level + LEAVES_HEIGHT) & (v < max(LEAVES_SPEED, LEAVES_SHARE * swing))
    return _stretches_with(stays | lands, lands)


def _stretches_with(stays: np.ndarray, lands: np.ndarray) -> np.ndarray:
    """The stretches of `stays` (F,) in which `lands` (F,) is true at least once."""
    begins = np.diff(stays, prepend=False) & stays
    number = np.cumsum(begins)
    return stays & np.isin(number, number[lands & stays])


def _centred_speeds(clip: Clip) -> Array:
    """(F, 4) speeds about each frame, cm a frame: a landing and a toe-off then look alike from both sides."""
    feet = foot_positions(clip)
    if len(feet) < 2:
        return np.zeros(feet.shape[:2])
    steps = np.linalg.norm(np.diff(feet, axis=0), axis=-1)
    return 0.5 * (np.concatenate([steps[:1], steps]) + np.concatenate([steps, steps[-1:]]))
