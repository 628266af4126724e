"""Measures the skeleton to which a motion will be retargeted: spine, tilt of the feet, lengths of limbs."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion.axes import rest_frame
from hobble.motion.body import SIDES, Body
from hobble.motion.spine import Spine

# A rig has the target's proportions if length in the rig / length in the target is the same for all limb
# bones. The largest of these quotients may exceed the smallest by less than this share.
SAME = 0.01


@dataclass(frozen=True)
class TargetProportions:
    """The proportions of a skeleton with a standing rest pose.

    spine: the shape of its trunk and neck in that pose. foot_tilt: angle in radians by which the bone from
    ankle to ball of the foot points below the horizontal, mean of both feet. limb_lengths: (B,) lengths of
    the B bones that `limb_bones` returns, cm.
    """

    spine: Spine
    foot_tilt: float
    limb_lengths: Array

    @classmethod
    def from_skeleton(cls, skeleton: Skeleton, body: Body) -> TargetProportions:
        """The proportions of a skeleton. body: which joint is which part."""
        rest = quat.rotate(quat.inv(rest_frame(skeleton)), rest_positions(skeleton))
        feet = np.array([rest[toe] - rest[heel] for *_, heel, toe in body.legs.values() if toe is not None])
        tilt = float(np.mean(np.arctan2(-feet[:, 1], np.linalg.norm(feet[:, [0, 2]], axis=-1))))
        limbs = np.array([float(np.linalg.norm(rest[b] - rest[a])) for a, b in limb_bones(body)])
        return cls(Spine.from_skeleton(skeleton, body), tilt, limbs)

    def matches_limb_lengths(self, limbs: Array) -> bool:
        """Whether the limbs of a rig have these proportions.

        limbs: lengths of the bones that `limb_bones` returns for the rig, in any unit.
        """
        if len(limbs) != len(self.limb_lengths):
            return False
        quotients = np.maximum(limbs, 1e-9) / self.limb_lengths
        return bool(quotients.max() < (1 + SAME) * quotients.min())


def limb_bones(body: Body) -> list[tuple[int, int]]:
    """The bones of legs, feet and arms, as pairs (joint at the start, joint at the end).

    Clavicles are left out, and feet without a joint at the ball.
    """
    bones: list[tuple[int, int]] = []
    for side in SIDES:
        for limb in (body.legs[side], body.arms[side][1:]):
            bones += pairwise(joint for joint in limb if joint is not None)
    return bones
