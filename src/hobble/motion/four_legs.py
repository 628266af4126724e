"""Recognises figures that walk on four legs, whose motion cannot be put on a person's skeleton."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.motion.body import SIDES, Body
from hobble.motion.orient import unit

STRETCHED = 0.7  # least distance of hips and feet, in leg lengths; a crawling person kneels and has less
REACH = 0.6  # least depth of the hands below the hips, as a share of the depth of the feet
LEVEL = -0.5  # least cosine between a level trunk and the legs; it is -1 in a standing person
NEARLY_ALL = 0.9  # all this has to be true in more than this share of the frames


def on_four_legs(body: Body, positions: Array) -> bool:
    """Whether the figure stands on hands and feet, below a level trunk, in nearly all frames.

    positions: (F, J, 3) in the world, any unit, any axes.
    """
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
    down = unit(feet - hips)
    depth = np.linalg.norm(feet - hips, axis=-1)
    level = np.sum(unit(chest - hips) * down, axis=-1) > LEVEL
    reach = np.sum((hands - hips) * down, axis=-1) > REACH * depth
    return bool(np.mean(level & reach & (depth > STRETCHED * leg_length)) > NEARLY_ALL)
