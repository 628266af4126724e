"""Sets the height of the hips so that the standing knee has the desired bend, and places the knees."""

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
from hobble.hurt.interpolate import at_frames, turns_at

# Radians of knee flexion. Below the first value the bend is too small to tell where the knee points. Above
# the second value it is large enough.
BENT = np.radians([6.0, 18.0])
STRETCH = (0.985, 0.9985)  # leg lengths: least and greatest value of `Leg.longest`


@dataclass(frozen=True)
class Leg:
    """A leg of the healthy clip, over F frames.

    reach: (F,) cm from hip to ankle. thigh, shank: (F, 4) rotations relative to the pelvis. hinge: (F, 3)
    axis of the knee, also relative to the pelvis. upper, lower: lengths of thigh and shank, cm.
    """

    reach: Array = field(repr=False)
    thigh: Array = field(repr=False)
    shank: Array = field(repr=False)
    hinge: Array = field(repr=False)
    upper: float
    lower: float

    @property
    def longest(self) -> float:
        """The largest distance from hip to ankle that is allowed, cm."""
        length = self.upper + self.lower
        return float(np.clip(self.reach.max(), STRETCH[0] * length, STRETCH[1] * length))


def read_leg(clip: Clip, side: int) -> Leg:
    """Measure a leg. While it is nearly straight, its knee points as in the frames in which it is bent."""
    skeleton = clip.skeleton
    hip, knee, heel = (skeleton.role(f"{SIDES[side]}_{r}") for r in ("hip", "knee", "heel"))
    at = clip.positions
    along = at[:, heel] - at[:, hip]
    reach = np.linalg.norm(along, axis=1)
    unit = along / np.maximum(reach, 1e-9)[:, None]
    out = at[:, knee] - at[:, hip]
    out = out - unit * np.sum(out * unit, axis=1, keepdims=True)
    size = np.linalg.norm(out, axis=1, keepdims=True)
    upper, lower = (float(np.linalg.norm(skeleton.offsets[j])) for j in (knee, heel))
    bend = knee_flexion(reach, upper, lower)
    sure = np.clip((bend - BENT[0]) / (BENT[1] - BENT[0]), 0.0, 1.0)[:, None]
    thigh = clip.global_rotations[:, hip]
    in_thigh = quat.rotate(quat.inv(thigh), out / np.maximum(size, 1e-9))
    usual = np.sum(in_thigh * sure, axis=0) if sure.sum() > 5 else _forward(clip, side, thigh)
    usual = usual / max(float(np.linalg.norm(usual)), 1e-9)
    points = quat.rotate(thigh, in_thigh * sure + usual * (1 - sure))
    pelvis = quat.inv(clip.global_rotations[:, skeleton.role("hips")])
    return Leg(
        reach,
        quat.mul(pelvis, thigh),
        quat.mul(pelvis, clip.global_rotations[:, knee]),
        quat.rotate(pelvis, np.cross(points, unit)),
        upper,
        lower,
    )


def _forward(clip: Clip, side: int, thigh: Array) -> Array:
    """(3,) mean direction of the foot in the coordinates of the thigh, for a knee that never bends."""
    heel, toe = (clip.skeleton.role(f"{SIDES[side]}_{r}") for r in ("heel", "toe"))
    return np.mean(quat.rotate(quat.inv(thigh), clip.positions[:, toe] - clip.positions[:, heel]), axis=0)


def knee_flexion(reach: Array, upper: float, lower: float) -> Array:
    """(...) radians of knee flexion, 0 if straight. reach: (...) distance from hip to ankle."""
    cosine = (reach**2 - upper**2 - lower**2) / (2 * upper * lower)
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def reach_of(flexion: Array, upper: float, lower: float) -> Array:
    """(...) distance from hip to ankle at a knee flexion: the inverse of `knee_flexion`."""
    return np.sqrt(upper**2 + lower**2 + 2 * upper * lower * np.cos(flexion))


def hips_height(
    root: Array,
    hips: list[Array],
    ankles: list[Array],
    reaches: list[Array],
    stands: list[Array],
    longest: list[float],
) -> Array:
    """(N,) heights of the root.

    root: (N, 3) positions before the change. The lists hold an entry for each leg. hips: (N, 3) position of
    the hip joint relative to the root. ankles: (N, 3) positions in the world. reaches: (N,) desired distance
    from hip to ankle while the leg stands, cm. stands: (N,) from 0 (swings) to 1 (stands). longest:
    `Leg.longest`.
    """
    needed = np.zeros(len(root))
    weight = np.full(len(root), 1e-9)
    for hip, ankle, reach, stand in zip(hips, ankles, reaches, stands, strict=True):
        apart = (root + hip - ankle)[:, [0, 2]]
        level = np.minimum(np.sum(apart**2, axis=1), (0.97 * reach) ** 2)
        higher = ankle[:, 1] + np.sqrt(reach**2 - level) - hip[:, 1] - root[:, 1]
        needed += stand * higher
        weight += stand
    height = root[:, 1] + gaussian(needed, 3.0) / gaussian(weight, 3.0)
    excess = np.zeros(len(root))
    for hip, ankle, length in zip(hips, ankles, longest, strict=True):
        apart = (root + hip - ankle)[:, [0, 2]]
        level = np.minimum(np.sum(apart**2, axis=1), (0.97 * length) ** 2)
        excess = np.maximum(excess, height + hip[:, 1] - ankle[:, 1] - np.sqrt(length**2 - level))
    return height - smooth_above(np.maximum(excess, 0.0), 2)


def place_leg(
    skeleton: Skeleton, side: int, leg: Leg, when: Array, pelvis: Array, hip: Array, ankle: Array
) -> tuple[Array, Array]:
    """World rotations (N, 4) of thigh and shank that put the ankle in its place.

    when: (N,) source frames from which the direction of the knee is taken. pelvis: (N, 4) world rotations.
    hip, ankle: (N, 3) positions in the world.
    """
    bones = [skeleton.offsets[skeleton.role(f"{SIDES[side]}_{r}")] for r in ("knee", "heel")]
    thigh, shank = (quat.mul(pelvis, turns_at(rotations, when)) for rotations in (leg.thigh, leg.shank))
    hinge = quat.rotate(pelvis, at_frames(leg.hinge, when))
    knee, end = two_bone_knee(hip, ankle, np.cross(ankle - hip, hinge), leg.upper, leg.lower)
    return _turned(thigh, hinge, bones[0], knee - hip), _turned(shank, hinge, bones[1], end - knee)


def _turned(world: Array, hinge: Array, bone: Array, along: Array) -> Array:
    """World rotations (N, 4), turned so that the bone points along `along`.

    hinge: (N, 3) axis of the knee, which is kept. bone: (3,) vector of the bone at rest. along: (N, 3).
    """
    turn = _bone_axes(along, hinge) @ np.swapaxes(_bone_axes(quat.rotate(world, bone), hinge), -1, -2)
    return quat.mul(quat.from_matrix(turn), world)


def _bone_axes(along: Array, hinge: Array) -> Array:
    """(N, 3, 3) unit vectors as columns: the hinge made orthogonal to the bone, the bone, and across both."""
    y = along / np.linalg.norm(along, axis=-1, keepdims=True)
    x = hinge - y * np.sum(hinge * y, axis=-1, keepdims=True)
    x = x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-9)
    return np.stack([x, y, np.cross(x, y)], axis=-1)
