"""Checks whether a person could stand in a rest pose."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hobble.core.quat import Array
from hobble.motion.body import SIDES, Body
from hobble.motion.orient import degrees_between, unit
from hobble.motion.spine import SHORT

# Largest angles of a standing person, in degrees. Straight up is from the hips to the shoulders. Legs: from
# straight down; trunk and head: from straight up; feet: from straight ahead.
LEG, TRUNK, HEAD, FOOT = 40.0, 40.0, 50.0, 50.0


def why_not_standing(body: Body, rest: Array) -> str | None:
    """Why a person could not stand in the rest pose `rest` (J, 3), in words; None if a person could."""
    hips = 0.5 * (rest[body.legs["left"][0]] + rest[body.legs["right"][0]])
    shoulders = 0.5 * (rest[body.arms["left"][1]] + rest[body.arms["right"][1]])
    up = unit(shoulders - hips)
    left = rest[body.legs["left"][0]] - rest[body.legs["right"][0]]
    across = rest[body.arms["left"][1]] - rest[body.arms["right"][1]]
    if degrees_between(left, across) > 30 or abs(degrees_between(left, up) - 90) > 25:
        return "hips and shoulders point in different directions"
    if degrees_between(rest[body.head] - shoulders, up) > HEAD:
        return "the head is not above the shoulders"
    ahead = np.cross(unit(left), up)
    facing = []
    for side in SIDES:
        hip, knee, heel, toe = body.legs[side]
        if (
            max(degrees_between(rest[knee] - rest[hip], -up), degrees_between(rest[heel] - rest[knee], -up))
            > LEG
        ):
            return f"the {side} leg does not point down"
        if toe is not None:
            foot = rest[toe] - rest[heel]
            flat = foot - up * (foot @ up)
            facing.append(flat @ ahead)
            if abs(degrees_between(flat, ahead) - 90) < 90 - FOOT or np.linalg.norm(
                flat
            ) < 0.4 * np.linalg.norm(foot):
                return f"the {side} foot does not point forward"
    if facing and min(facing) < 0 < max(facing):
        return "the feet point in opposite directions"
    trunk = [rest[j] for j in (body.hips, *body.trunk)]
    for a, b in pairwise(trunk):
        if np.linalg.norm(b - a) > SHORT and degrees_between(b - a, up) > TRUNK:
            return "the trunk is not straight"
    return None
