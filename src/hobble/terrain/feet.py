"""Where the soles of the feet are, and when they stand on the ground."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

ROLES = ("left_heel", "left_toe", "right_heel", "right_toe")
HEEL = np.array([True, False, True, False])


@dataclass(frozen=True)
class Feet:
    """The four contact joints over F frames.

    soles: (F, 4, 3) positions less the height of the joint above its sole, cm. contacts: (F, 4) bool.
    heel_height, toe_height: what was taken off.
    """

    soles: Array = field(repr=False)
    contacts: Array = field(repr=False)
    heel_height: float
    toe_height: float


def feet_of(
    clip: Clip,
    contacts: Array,
    frames: np.ndarray,
    flat: bool,
    *,
    heel_height: float | str,
    toe_height: float | str,
    sole: float,
    deepest: float | None,
) -> Feet:
    """The soles of a clip. A height of "auto" is found from the clip or its skeleton.

    frames: those that count, (N,). On flat ground, which lies at zero, "auto" is the median height of the joints in
    contact, or less where a foot would otherwise go further than `deepest` (cm) below the ground. Elsewhere the toe
    joint is `sole` cm above the ground, and the heel as much higher as in the skeleton's rest pose.
    """
    joints = clip.positions[:, [clip.skeleton.role(role) for role in ROLES]].copy()
    contacts = np.asarray(contacts, bool)
    found: dict[str, float] = {}
    for name, wanted, columns in (("heel", heel_height, HEEL), ("toe", toe_height, ~HEEL)):
        if wanted != "auto":
            found[name] = float(wanted)
        elif flat and contacts[frames][:, columns].any():
            heights, down = joints[frames][:, columns, 1], contacts[frames][:, columns]
            median = float(np.median(heights[down]))
            found[name] = median if deepest is None else min(median, float(heights.min()) + deepest)
        else:
            found[name] = sole + (heel_above_toe(clip.skeleton) if name == "heel" else 0.0)
    joints[..., 1] -= np.where(HEEL, found["heel"], found["toe"])
    return Feet(joints, contacts, found["heel"], found["toe"])


def heel_above_toe(skeleton: Skeleton) -> float:
    """How much higher the heel joint is than the toe joint in the rest pose, cm, both sides together."""
    from hobble.core.skeleton import forward_kinematics

    rest = np.zeros((1, len(skeleton.joints), 4))
    rest[..., 0] = 1
    _, positions = forward_kinematics(skeleton, rest, np.zeros((1, 3)))
    heights = positions[0, [skeleton.role(role) for role in ROLES], 1]
    return float(heights[HEEL].mean() - heights[~HEEL].mean())
