"""Chooses the poses that show how the pelvis is turned against the spine.

The spine is about straight in upright poses. In a bow or a squat it bends. If such a bent spine were taken
for straight, the pelvis would come out tilted.

A sample is S moments of a clip. The zero pose of a rig is the one in which all rotations are zero.
"""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.motion.body import SIDES
from hobble.motion.body_sample import BodySample
from hobble.motion.orient import unit_vectors

# A leg is stretched if the distance from hip to ankle is more than this share of the leg's length. An upright
# figure has at least one stretched leg.
STRETCHED = 0.8
UPRIGHT_LEAN = 25.0  # degrees: the trunk of an upright figure leans less than this
# Degrees: a figure stoops if its trunk leans more than this. The straight trunk of a sprinter leans up to 35.
STOOPED_LEAN = 40.0
FEWEST = 0.05  # least share of the moments that must be upright
# Degrees: the moments are chosen that lean less than this plus the 5 % quantile (FEWEST) of the lean.
SPREAD = 15.0
POSITION_ERROR = 3.0  # cm: mean error of the positions of hips and head in clips of bows and squats


def trunk_sample(sample: BodySample, stands_in_zero: bool) -> BodySample:
    """The most upright moments of a sample.

    stands_in_zero: whether a person could stand in the zero pose. If too few moments are upright, the result
    is the zero pose if a person could stand in it, and otherwise the whole sample.
    """
    leans = _leans(sample)
    if np.mean(leans < UPRIGHT_LEAN) >= FEWEST:
        return sample.at_moments(leans < np.quantile(leans, FEWEST) + SPREAD)
    return sample.in_zero_pose() if stands_in_zero else sample


def stoop_doubt(sample: BodySample, stands_in_zero: bool) -> str | None:
    """A warning if the figure nearly always stoops or squats and its zero pose is no stance, else None.

    stands_in_zero: whether a person could stand in the zero pose.
    """
    if stands_in_zero or np.mean(_leans(sample) < STOOPED_LEAN) >= FEWEST:
        return None
    return (
        "The figure is almost never upright, and nobody could stand in its zero pose. So it is uncertain how "
        f"far its pelvis tilts. Hips, trunk and arms may lie {POSITION_ERROR:g} cm too far forward or back."
    )


def _leans(sample: BodySample) -> Array:
    """(S,) degrees between the trunk and the vertical; 180 in moments in which no leg is stretched."""
    body = sample.body
    shoulders, hips = (
        sample.positions[:, limbs["left"][k]] + sample.positions[:, limbs["right"][k]]
        for limbs, k in ((body.arms, 1), (body.legs, 0))
    )
    leans = np.degrees(np.arccos(np.clip(unit_vectors(shoulders - hips)[:, 1], -1.0, 1.0)))
    stretch = np.max([_leg_stretch(sample, *body.legs[side][:3]) for side in SIDES], axis=0)
    return np.where(stretch > STRETCHED, leans, 180.0)


def _leg_stretch(sample: BodySample, hip: int, knee: int, ankle: int) -> Array:
    """(S,) distance from hip to ankle, as a share of the leg's length. The joints are given by index."""
    reach = np.linalg.norm(sample.positions[:, ankle] - sample.positions[:, hip], axis=-1)
    return reach / max(sample.length(hip, knee, ankle), 1e-9)
