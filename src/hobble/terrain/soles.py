"""Positions of the soles of the feet, and when they are on the ground."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

Mask = NDArray[np.bool_]

FOOT_ROLES = ("left_heel", "left_toe", "right_heel", "right_toe")  # roles of joints of a `Skeleton`
IS_HEEL = np.array([True, False, True, False])  # whether each of FOOT_ROLES is a heel
OTHER_OF_FOOT = [1, 0, 3, 2]  # for each of FOOT_ROLES, the index of the other joint of the same foot


@dataclass(frozen=True)
class Feet:
    """The four contact joints over F frames, in the order of FOOT_ROLES.

    soles: (F, 4, 3) positions of the soles below the joints, cm. contacts: (F, 4) whether each joint is in
    contact with the ground. heel_height, toe_height: height of the joints above their soles, cm.
    """

    soles: Array = field(repr=False)
    contacts: Mask = field(repr=False)
    heel_height: float
    toe_height: float


def find_soles(
    clip: Clip,
    contacts: Mask,
    frames: np.ndarray,
    flat: bool,
    *,
    heel_height: float | str,
    toe_height: float | str,
    sole: float,
    deepest: float | None,
) -> Feet:
    """The soles of a clip: the contact joints, lowered by `heel_height` and `toe_height`.

    contacts: (F, 4). heel_height, toe_height: height of the joints above their soles, cm, or "auto".
    frames: (N,) the frames from which "auto" is computed. flat: whether the ground is flat, and then at
    height 0.

    On flat ground "auto" is the median height of the joints in contact. If this puts a sole more than
    `deepest` cm below the ground, the height is reduced by just enough to prevent that; but if more than
    `deepest` cm would be needed, it stays the median. On other ground, or without contacts, the toe joint is
    `sole` cm above its sole, and the heel joint is higher than the toe joint by as much as in the rest pose.
    """
    joints = clip.positions[:, [clip.skeleton.role(role) for role in FOOT_ROLES]].copy()
    above_sole: list[float] = []
    for setting, columns in ((heel_height, IS_HEEL), (toe_height, ~IS_HEEL)):
        heights, down = joints[frames][:, columns, 1], contacts[frames][:, columns]
        if setting != "auto":
            above_sole.append(float(setting))
        elif flat and down.any():
            above_sole.append(_flat_height(heights, down, deepest))
        else:
            above_sole.append(sole + (heel_above_toe(clip.skeleton) if columns is IS_HEEL else 0.0))
    joints[..., 1] -= np.where(IS_HEEL, *above_sole)
    return Feet(joints, contacts, *above_sole)


def is_above_other_joint(feet: Feet, least: float) -> Mask:
    """(F, 4) whether the other joint of the same foot is in contact and more than `least` cm lower."""
    height = feet.soles[..., 1]
    return (height - height[:, OTHER_OF_FOOT] > least) & feet.contacts[:, OTHER_OF_FOOT]


def _flat_height(heights: Array, down: Array, deepest: float | None) -> float:
    """The value of "auto" on flat ground, cm; see `find_soles`.

    heights: (N, 2) of the heel or toe joints, cm. down: (N, 2) whether they are in contact.
    """
    median = float(np.median(heights[down]))
    highest = float(heights.min()) + (deepest or 0.0)  # a larger value puts the lowest sole below -deepest
    return highest if deepest is not None and median - deepest <= highest < median else median


def heel_above_toe(skeleton: Skeleton) -> float:
    """Height of the heel joint above the toe joint in the rest pose, cm, mean of both sides."""
    from hobble.core.skeleton import forward_kinematics

    rest = np.zeros((1, len(skeleton.joints), 4))
    rest[..., 0] = 1  # no rotation: quaternions, w first
    _, positions = forward_kinematics(skeleton, rest, np.zeros((1, 3)))
    heights = positions[0, [skeleton.role(role) for role in FOOT_ROLES], 1]
    return float(heights[IS_HEEL].mean() - heights[~IS_HEEL].mean())
