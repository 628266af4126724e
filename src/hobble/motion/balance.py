"""Finds which way is down from how a body balances on its feet.

While only one foot stands, the force of the ground acts at a point under this foot, the zero moment point,
and points to the body's centre of mass (Vukobratovic and Borovac 2004). The force has two parts: one holds
the body against gravity, and one accelerates it. So the standing feet and the accelerations in a few steps
show the direction of gravity, even if the body leans or the ground slopes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import gaussian
from hobble.motion.body import SIDES
from hobble.motion.rig import leg_length
from hobble.motion.root import facing_directions

GRAVITY = 981.0  # cm / s2
# TRUNK, HEAD: shares of the body's mass (de Leva 1996). TRUNK_CENTRE: where the trunk's centre of mass is,
# between the hips (0) and the shoulders (1). The head's centre of mass is taken to be at the head's joint.
TRUNK, TRUNK_CENTRE = 0.4346, 0.55
HEAD = 0.0694
# Segments on each side of the body: share of the body's mass, role of the first joint, role of the second
# joint, and where the segment's centre of mass is, between the first joint (0) and the second (1).
SEGMENTS = (
    (0.0271, "shoulder", "elbow", 0.577),
    (0.0162, "elbow", "wrist", 0.457),
    (0.0061, "wrist", "wrist", 0.0),
    (0.1416, "hip", "knee", 0.41),
    (0.0433, "knee", "heel", 0.446),
    (0.0137, "heel", "toe", 0.5),
)
# Seconds: standard deviation of the Gaussian that smooths positions before accelerations are computed.
SMOOTH = 0.04
# Leg lengths a second: the ball of a standing foot is slower than this. Ball and heel of a swinging foot are
# faster.
SLOW_FOOT = 0.4
# Leg lengths: if the hips are not this far above the ankle of the standing foot, the figure sits or kneels.
UPRIGHT = 0.6
SHORTEST = 0.06  # seconds: each foot must stand alone for at least this time, or no direction is found
# PRESSED: the point between ankle (0) and ball (1) at which the force of the ground acts, for a figure that
# moves forward at the speeds SPEEDS. Speeds are divided by the square root of gravity times leg length. The
# points are means over 172 clips: of the data sets `cmu`, `styles` and `patients`, of Ferre et al. and of
# Holden et al. (2017).
SPEEDS, PRESSED = (-0.1, 0.0, 0.1), (0.45, 0.25, 1.0)
# In these clips, the direction found in runs leans forward by mistake: by LEAN degrees at the speeds RUNS,
# which are divided like SPEEDS. This lean is subtracted.
RUNS, LEAN = (0.5, 0.9), (0.0, 3.5)


@dataclass(frozen=True)
class Balance:
    """The direction against gravity, found from how the body balances.

    up: (2,) x and z of this direction, scaled to y = 1. In 172 clips, the standard deviation of its error is
    1 degree to the side and 1.9 degrees forward; in short clips it is twice as large. left: (2,) x and z of
    the mean direction to the body's left, a unit vector. seconds: how long the figure stood on the left foot
    alone or on the right foot alone, whichever is shorter.
    """

    up: Array
    left: Array
    seconds: float

    @property
    def aside(self) -> float:
        """Degrees by which the direction against gravity leans from Y towards the body's left."""
        return float(np.degrees(np.arcsin(np.clip(self.up @ self.left, -1.0, 1.0))))


class _BodyMotion(NamedTuple):
    """What the balance of a body depends on, in F frames.

    at: role -> (F, 3) positions, cm. ahead: (F, 3) unit vectors along which the body faces. speed: (F,)
    forward speed, divided by the square root of gravity times leg length. centre: (F, 3) centre of mass, cm.
    push: (F, 3) acceleration of this centre, divided by the sum of gravity and vertical acceleration.
    """

    at: dict[str, Array]
    ahead: Array
    speed: Array
    centre: Array
    push: Array


def find_balance(clip: Clip) -> Balance | None:
    """The direction against gravity, or None if the body does not stand long enough on each foot alone."""
    fps, leg = clip.fps, leg_length(clip.skeleton)
    reach = max(1, round(fps / 20))  # frames: speeds of feet are measured over 50 ms before and after
    if len(clip) < 4 * reach + 3:  # no frame would be left without its ends, where speeds are not reliable
        return None
    at = {role: clip.positions[:, clip.skeleton.role(role)] for role in clip.skeleton.roles}
    ahead, centre = facing_directions(clip.skeleton, clip.positions, fps / 3), centre_of_mass(at)
    velocity = np.gradient(gaussian(at["hips"], 0.1 * fps), axis=0) * fps
    acceleration = np.gradient(np.gradient(gaussian(centre, SMOOTH * fps), axis=0), axis=0) * fps * fps
    forward_speed = np.sum(velocity * ahead, axis=-1) / np.sqrt(GRAVITY * leg)
    push = acceleration / (GRAVITY + acceleration[:, 1:2])
    motion = _BodyMotion(at, ahead, forward_speed, centre, push)
    slow = {  # role of a foot's joint -> (F,) whether the joint is slow
        f"{side}_{part}": _speed(at[f"{side}_{part}"], reach) * fps < SLOW_FOOT * leg
        for side in SIDES
        for part in ("toe", "heel")
    }
    ups, seconds = [], []
    for side, other in (SIDES, SIDES[::-1]):
        # `alone`: the frames in which the foot of this side stands alone.
        alone = slow[f"{side}_toe"] & ~slow[f"{other}_toe"] & ~slow[f"{other}_heel"]
        alone &= at["hips"][:, 1] - at[f"{side}_heel"][:, 1] > UPRIGHT * leg
        alone[: 2 * reach] = alone[-2 * reach :] = False
        seconds.append(float(alone.sum() / fps))
        if seconds[-1] < SHORTEST:
            return None
        ups.append(_trimmed_mean(_up(motion, side)[alone]))
    left = np.cross([0.0, 1.0, 0.0], ahead).mean(axis=0)[[0, 2]]
    return Balance(0.5 * (ups[0] + ups[1]), left / max(float(np.linalg.norm(left)), 1e-9), min(seconds))


def centre_of_mass(at: dict[str, Array]) -> Array:
    """(..., 3) centre of mass of a body. Segments whose joints are missing are left out.

    at: role -> positions (..., 3).
    """
    hips, shoulders = (0.5 * (at[f"left_{part}"] + at[f"right_{part}"]) for part in ("hip", "shoulder"))
    total = TRUNK * (hips + TRUNK_CENTRE * (shoulders - hips)) + HEAD * at["head"]
    mass = TRUNK + HEAD
    for share, start, end, centre in SEGMENTS:
        for side in SIDES:
            a, b = at.get(f"{side}_{start}"), at.get(f"{side}_{end}")
            if a is not None and b is not None:
                total = total + share * (a + centre * (b - a))
                mass += share
    return np.asarray(total / mass)


def _up(motion: _BodyMotion, side: str) -> Array:
    """(F, 2) x and z of the direction against gravity, scaled to y = 1.

    side: "left" or "right". The result is only valid in frames in which the foot of this side stands alone.
    """
    heel, bone = motion.at[f"{side}_heel"], motion.at[f"{side}_toe"] - motion.at[f"{side}_heel"]
    pressed = np.interp(motion.speed, SPEEDS, PRESSED)[:, None]
    level = np.linalg.norm(bone * [1, 0, 1], axis=-1, keepdims=True)
    # `foot` is the point at which the force acts. Along the direction in which the body faces, it is at the
    # share `pressed` of the way from ankle to ball. Sideways, it is at the share `middle`.
    middle = 0.6
    foot = heel + middle * bone + (pressed - middle) * level * motion.ahead
    # The force points from `foot` to the centre of mass. Without its part that accelerates the body (`push`),
    # it points against gravity.
    arm = motion.centre - foot
    lean = np.radians(np.interp(motion.speed, RUNS, LEAN))[:, None] * motion.ahead
    return np.asarray((arm / np.maximum(arm[:, 1:2], 1.0) - motion.push - lean)[:, [0, 2]])


def _trimmed_mean(values: Array) -> Array:
    """(2,) mean of values (N, 2). In each column, the highest and the lowest tenth are left out."""
    low, high = np.quantile(values, [0.1, 0.9], axis=0)
    inside = (values >= low) & (values <= high)
    return np.asarray((values * inside).sum(axis=0) / inside.sum(axis=0))


def _speed(place: Array, reach: int) -> Array:
    """(F,) speed of a point, cm a frame, measured from `reach` frames before to `reach` frames after.

    place: (F, 3) its positions, cm. The first and last `reach` frames get the speed nearest to them.
    """
    steps = np.linalg.norm(place[2 * reach :] - place[: -2 * reach], axis=-1) / (2 * reach)
    return np.pad(steps, reach, mode="edge")
