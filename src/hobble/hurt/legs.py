"""Sets the height of the hips so that the standing knee has the desired bend, and places the knees.

The ankle is the joint with the role heel.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.ik import two_bone_knee
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.core.smooth import gaussian, smooth_above
from hobble.hurt.body_parts import SIDES
from hobble.hurt.interpolate import interpolate_rotations, interpolate_values

# Radians of knee flexion. Below the first value, the bend is too small to tell in which direction the knee
# points. Above the second value, the bend is large enough. Between them, it counts partly.
BENT = np.radians([6.0, 18.0])
STRETCH = (0.985, 0.9985)  # least and greatest value of `Leg.longest_reach`, in leg lengths
# For the height of the hips, the horizontal distance between hip and ankle counts as at most this share of
# the leg's length. Otherwise there would be no height at which a leg reaches a foot that is too far away.
LEVEL_SHARE = 0.97


@dataclass(frozen=True)
class Leg:
    """A leg of the healthy clip, over F frames.

    reach: (F,) cm from hip to ankle. thigh, shank: (F, 4) rotations relative to the pelvis. hinge: (F, 3)
    axis about which the knee bends, relative to the pelvis. thigh_length, shank_length: cm.
    """

    reach: Array = field(repr=False)
    thigh: Array = field(repr=False)
    shank: Array = field(repr=False)
    hinge: Array = field(repr=False)
    thigh_length: float
    shank_length: float

    @property
    def longest_reach(self) -> float:
        """The largest distance from hip to ankle that is allowed, cm."""
        length = self.thigh_length + self.shank_length
        return float(np.clip(self.reach.max(), STRETCH[0] * length, STRETCH[1] * length))


def read_leg(clip: Clip, side: int) -> Leg:
    """Measure a leg in each frame.

    In frames in which the leg is nearly straight, the direction of its knee is taken from the other frames.
    """
    skeleton = clip.skeleton
    hip, knee, ankle = (skeleton.role(f"{SIDES[side]}_{r}") for r in ("hip", "knee", "heel"))
    positions = clip.positions
    hip_to_ankle = positions[:, ankle] - positions[:, hip]
    reach = np.linalg.norm(hip_to_ankle, axis=1)
    along = hip_to_ankle / np.maximum(reach, 1e-9)[:, None]
    # How far the knee is from the straight line between hip and ankle, and in which direction.
    hip_to_knee = positions[:, knee] - positions[:, hip]
    aside = hip_to_knee - along * np.sum(hip_to_knee * along, axis=1, keepdims=True)
    size = np.linalg.norm(aside, axis=1, keepdims=True)
    upper, lower = (float(np.linalg.norm(skeleton.offsets[j])) for j in (knee, ankle))
    bend = knee_flexion(reach, upper, lower)
    certainty = np.clip((bend - BENT[0]) / (BENT[1] - BENT[0]), 0.0, 1.0)[:, None]
    thigh = clip.global_rotations[:, hip]
    in_thigh = quat.rotate(quat.inv(thigh), aside / np.maximum(size, 1e-9))
    bends = certainty.sum() > 5  # frames
    usual = np.sum(in_thigh * certainty, axis=0) if bends else _foot_direction(clip, side, thigh)
    usual = usual / max(float(np.linalg.norm(usual)), 1e-9)
    knee_direction = quat.rotate(thigh, in_thigh * certainty + usual * (1 - certainty))
    to_pelvis = quat.inv(clip.global_rotations[:, skeleton.role("hips")])
    return Leg(
        reach,
        quat.mul(to_pelvis, thigh),
        quat.mul(to_pelvis, clip.global_rotations[:, knee]),
        quat.rotate(to_pelvis, np.cross(knee_direction, along)),
        upper,
        lower,
    )


def _foot_direction(clip: Clip, side: int, thigh: Array) -> Array:
    """(3,) mean direction from heel to toe in the coordinates of the thigh.

    A knee that never bends is assumed to point in this direction.
    """
    heel, toe = (clip.skeleton.role(f"{SIDES[side]}_{r}") for r in ("heel", "toe"))
    return np.mean(quat.rotate(quat.inv(thigh), clip.positions[:, toe] - clip.positions[:, heel]), axis=0)


def knee_flexion(reach: Array, upper: float, lower: float) -> Array:
    """(...) radians of knee flexion, 0 if straight, by the law of cosines.

    reach: (...) distance from hip to ankle. upper, lower: lengths of thigh and shank. All are in cm.
    """
    cosine = (reach**2 - upper**2 - lower**2) / (2 * upper * lower)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def reach_at_flexion(flexion: Array, upper: float, lower: float) -> Array:
    """(...) cm from hip to ankle at a knee flexion (...) in radians: the inverse of `knee_flexion`."""
    return np.sqrt(upper**2 + lower**2 + 2 * upper * lower * np.cos(flexion))


def hips_height(
    root: Array,
    hips: list[Array],
    ankles: list[Array],
    reaches: list[Array],
    stands: list[Array],
    longest: list[float],
) -> Array:
    """(N,) heights of the root, cm, at which standing legs have their desired length.

    root: (N, 3) positions before the change. Each list holds one entry for each leg. hips: (N, 3) position of
    the hip joint relative to the root. ankles: (N, 3) positions in the world. reaches: (N,) desired distance
    from hip to ankle while the leg stands, cm. stands: (N,) from 0 (swings) to 1 (stands). longest: the leg's
    `Leg.longest_reach`. No leg gets longer than this.
    """
    # Each standing leg asks for a change of the root's height. The root gets their weighted mean, smoothed.
    weighted_change = np.zeros(len(root))
    weight = np.full(len(root), 1e-9)
    for hip, ankle, reach, stand in zip(hips, ankles, reaches, stands, strict=True):
        apart = (root + hip - ankle)[:, [0, 2]]
        level_squared = np.minimum(np.sum(apart**2, axis=1), (LEVEL_SHARE * reach) ** 2)
        change = ankle[:, 1] + np.sqrt(reach**2 - level_squared) - hip[:, 1] - root[:, 1]
        weighted_change += stand * change
        weight += stand
    height = root[:, 1] + gaussian(weighted_change, 3.0) / gaussian(weight, 3.0)
    # Lower the root where a leg would still be longer than `longest`.
    excess = np.zeros(len(root))
    for hip, ankle, length in zip(hips, ankles, longest, strict=True):
        apart = (root + hip - ankle)[:, [0, 2]]
        level_squared = np.minimum(np.sum(apart**2, axis=1), (LEVEL_SHARE * length) ** 2)
        excess = np.maximum(excess, height + hip[:, 1] - ankle[:, 1] - np.sqrt(length**2 - level_squared))
    return height - smooth_above(np.maximum(excess, 0.0), 2)


def place_leg(
    skeleton: Skeleton, side: int, leg: Leg, when: Array, pelvis: Array, hip: Array, ankle: Array
) -> tuple[Array, Array]:
    """World rotations of thigh and of shank, (N, 4) each, with which the leg reaches from `hip` to `ankle`.

    when: (N,) frames of the healthy clip, with fractions. The rotations and the direction of the knee in
    these frames are kept as far as the new positions allow. pelvis: (N, 4) world rotations. hip, ankle:
    (N, 3) positions in the world.
    """
    bones = [skeleton.offsets[skeleton.role(f"{SIDES[side]}_{r}")] for r in ("knee", "heel")]
    thigh, shank = (
        quat.mul(pelvis, interpolate_rotations(rotations, when)) for rotations in (leg.thigh, leg.shank)
    )
    hinge = quat.rotate(pelvis, interpolate_values(leg.hinge, when))
    knee, end = two_bone_knee(hip, ankle, np.cross(ankle - hip, hinge), leg.thigh_length, leg.shank_length)
    return _point_bone(thigh, hinge, bones[0], knee - hip), _point_bone(shank, hinge, bones[1], end - knee)


def _point_bone(world: Array, hinge: Array, bone: Array, along: Array) -> Array:
    """Turn world rotations (N, 4) of a bone so that it points along `along` (N, 3).

    bone: (3,) vector of the bone at rest. hinge: (N, 3) axis of the knee in the world. The bone's angle to
    this axis may change, but the bone does not roll against the axis.
    """
    turn = _bone_axes(along, hinge) @ np.swapaxes(_bone_axes(quat.rotate(world, bone), hinge), -1, -2)
    return quat.mul(quat.from_matrix(turn), world)


def _bone_axes(along: Array, hinge: Array) -> Array:
    """(N, 3, 3) the axes of a bone as columns, unit vectors that are orthogonal to each other.

    They are: the hinge without its part along the bone; the direction of the bone; the normal of these two.
    """
    y = along / np.linalg.norm(along, axis=-1, keepdims=True)
    x = hinge - y * np.sum(hinge * y, axis=-1, keepdims=True)
    x = x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-9)
    return np.stack([x, y, np.cross(x, y)], axis=-1)
