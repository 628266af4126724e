"""Recognises figures that walk on four legs, whose motion cannot be put on a person's skeleton."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.motion.body import SIDES, Body
from hobble.motion.orient import unit_vectors

# A figure counts as four-legged if three things hold in more than the share NEARLY_ALL of the frames:
# - Hips and feet are further apart than STRETCHED, in leg lengths. In a person who crawls on the knees they
# are   nearer. - The hands are further below the hips than the share REACH of the distance from hips to feet.
# - The cosine of the angle between the directions from the hips to the chest and from the hips to the feet is
# larger than LEVEL. It is -1 in a standing person, and 0 if the trunk is level.
STRETCHED, REACH, LEVEL, NEARLY_ALL = 0.7, 0.6, -0.5, 0.9


def on_four_legs(body: Body, positions: Array) -> bool:
    """Whether the figure stands on hands and feet, with a level trunk, in nearly all frames.

    positions: (F, J, 3) of the joints in the world, in any unit and along any axes.
    """
    # In a Body, a leg lists hip, knee, heel and toe, and an arm lists clavicle, shoulder, elbow and wrist.
    hips, chest = (
        0.5 * (positions[:, limbs["left"][k]] + positions[:, limbs["right"][k]])
        for limbs, k in ((body.legs, 0), (body.arms, 1))
    )
    feet, hands = (
        0.5 * (positions[:, limbs["left"][k]] + positions[:, limbs["right"][k]])
        for limbs, k in ((body.legs, 2), (body.arms, 3))
    )
    leg_length = np.zeros(len(positions))
    for side in SIDES:
        for a, b in ((0, 1), (1, 2)):
            bone = positions[:, body.legs[side][b]] - positions[:, body.legs[side][a]]
            leg_length += 0.5 * np.linalg.norm(bone, axis=-1)
    # No axis needs to point up, because down is the direction from the hips to the feet.
    down = unit_vectors(feet - hips)
    depth = np.linalg.norm(feet - hips, axis=-1)
    trunk_level = np.sum(unit_vectors(chest - hips) * down, axis=-1) > LEVEL
    hands_low = np.sum((hands - hips) * down, axis=-1) > REACH * depth
    return bool(np.mean(trunk_level & hands_low & (depth > STRETCHED * leg_length)) > NEARLY_ALL)
