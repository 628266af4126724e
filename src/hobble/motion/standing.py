"""Checks whether a person could stand in a rest pose."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hobble.core.quat import Array
from hobble.motion.body import SIDES, Body
from hobble.motion.orient import degrees_between, unit_vectors
from hobble.motion.spine import SHORT

# Largest angles, in degrees, by which parts of a standing person differ from a direction. Legs are compared
# with down, trunk and head with up, and feet with straight ahead. Up is the direction from the hips to the
# shoulders.
LEG, TRUNK, HEAD, FOOT = 40.0, 40.0, 50.0, 50.0


def why_not_standing(body: Body, rest: Array) -> str | None:
    """Why a person could not stand in a rest pose, in words; None if a person could.

    body: which joint is which part. rest: (J, 3) positions of the joints in the rest pose, cm. The
    coordinates may be left-handed.
    """
    hips = 0.5 * (rest[body.legs["left"][0]] + rest[body.legs["right"][0]])
    shoulders = 0.5 * (rest[body.arms["left"][1]] + rest[body.arms["right"][1]])
    up = unit_vectors(shoulders - hips)
    hips_left = rest[body.legs["left"][0]] - rest[body.legs["right"][0]]
    shoulders_left = rest[body.arms["left"][1]] - rest[body.arms["right"][1]]
    if degrees_between(hips_left, shoulders_left) > 30 or abs(degrees_between(hips_left, up) - 90) > 25:
        return "hips and shoulders point in different directions"
    if degrees_between(rest[body.head] - shoulders, up) > HEAD:
        return "the head is not above the shoulders"
    ahead = np.cross(unit_vectors(hips_left), up)  # straight back in left-handed coordinates
    forward = []  # for each foot, how far it reaches along `ahead`
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
            forward.append(flat @ ahead)
            # A foot may point along `ahead` or against it, but not sideways, and not steeply up or down.
            sideways = abs(degrees_between(flat, ahead) - 90) < 90 - FOOT
            if sideways or np.linalg.norm(flat) < 0.4 * np.linalg.norm(foot):
                return f"the {side} foot does not point forward"
    if forward and min(forward) < 0 < max(forward):
        return "the feet point in opposite directions"
    trunk = [rest[j] for j in (body.hips, *body.trunk)]
    for a, b in pairwise(trunk):
        if np.linalg.norm(b - a) > SHORT and degrees_between(b - a, up) > TRUNK:
            return "the trunk is not straight"
    return None
