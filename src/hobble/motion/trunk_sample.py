"""Chooses the poses that show how the pelvis is turned against the spine.

Upright poses show it, because the spine is about straight in them. In a bow or a squat the spine bends. If it
were taken for straight, the pelvis would come out tilted.
"""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.motion.body import SIDES
from hobble.motion.body_sample import BodySample
from hobble.motion.orient import unit

# In at least one leg of an upright figure, hip and ankle are this share of the leg's length apart, or more.
STRETCHED = 0.8
LEANS = 25.0  # degrees: the trunk of an upright figure leans less than this
# Degrees: a figure stoops if its trunk leans more than this. The straight trunk of a sprinter leans up to 35.
STOOPS = 40.0
FEWEST = 0.05  # least share of the frames that must be upright
# Degrees: the sample is all frames that lean less than this plus the 5 % quantile (FEWEST) of the lean.
SPREAD = 15.0
OFF = 3.0  # cm: mean error of the positions of hips and head in clips of bows and squats


def trunk_sample(sample: BodySample, zero: bool) -> BodySample:
    """The upright frames of a sample. If there are too few: its zero pose if `zero`, else all its frames.

    zero: whether a person could stand in the zero pose.
    """
    leans = _leans(sample)
    if np.mean(leans < LEANS) >= FEWEST:
        return sample.part(leans < np.quantile(leans, FEWEST) + SPREAD)
    return sample.in_zero_pose() if zero else sample


def stoop_doubt(sample: BodySample, zero: bool) -> str | None:
    """A warning if the figure always stoops or squats and nobody could stand in its zero pose, else None.

    zero: whether a person could stand in the zero pose.
    """
    if zero or np.mean(_leans(sample) < STOOPS) >= FEWEST:
        return None
    return (
        "The figure is never upright, and nobody could stand in its zero pose, so how far its pelvis tilts "
        f"is uncertain: hips, trunk and arms may lie {OFF:g} cm too far forward or back."
    )


def _leans(sample: BodySample) -> Array:
    """(S,) degrees between the trunk and the vertical; 180 in frames in which no leg is stretched."""
    body = sample.body
    shoulders, hips = (
        sample.at[:, limbs["left"][k]] + sample.at[:, limbs["right"][k]]
        for limbs, k in ((body.arms, 1), (body.legs, 0))
    )
    leans = np.degrees(np.arccos(np.clip(unit(shoulders - hips)[:, 1], -1.0, 1.0)))
    stretch = np.max([_stretch(sample, *body.legs[side][:3]) for side in SIDES], axis=0)
    return np.where(stretch > STRETCHED, leans, 180.0)


def _stretch(sample: BodySample, hip: int, knee: int, heel: int) -> Array:
    """(S,) distance from hip to ankle, as a share of the leg's length."""
    reach = np.linalg.norm(sample.at[:, heel] - sample.at[:, hip], axis=-1)
    return reach / max(sample.length(hip, knee, heel), 1e-9)
