"""Measures the build of the skeleton to which a motion will be retargeted: spine, tilt of the feet, limbs."""

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
class TargetBuild:
    """The build of a skeleton with a standing rest pose.

    spine: the shape of its trunk and neck in that pose. tilt: angle in radians by which the bone from ankle
    to ball of the foot points below the horizontal, mean of both feet. limbs: (B,) lengths of the B bones
    that `limb_bones` returns, cm.
    """

    spine: Spine
    tilt: float
    limbs: Array

    @classmethod
    def of(cls, skeleton: Skeleton, body: Body) -> TargetBuild:
        """The build of a skeleton. body: which joint is which part."""
        rest = quat.rotate(quat.inv(rest_frame(skeleton)), rest_positions(skeleton))
        feet = np.array([rest[toe] - rest[heel] for *_, heel, toe in body.legs.values() if toe is not None])
        tilt = float(np.mean(np.arctan2(-feet[:, 1], np.linalg.norm(feet[:, [0, 2]], axis=-1))))
        limbs = np.array([float(np.linalg.norm(rest[b] - rest[a])) for a, b in limb_bones(body)])
        return cls(Spine.of(skeleton, body), tilt, limbs)

    def is_built_like(self, limbs: Array) -> bool:
        """Whether a rig has the proportions of this build.

        limbs: lengths of the bones that `limb_bones` returns for the rig, in any unit.
        """
        if len(limbs) != len(self.limbs):
            return False
        quotients = np.maximum(limbs, 1e-9) / self.limbs
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
