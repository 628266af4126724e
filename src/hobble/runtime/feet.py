"""Feet on the ground: a foot in contact is held where it landed, and the leg bends to reach (two-bone IK)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from hobble.core.skeleton import Skeleton
from hobble.runtime.network import Network

LOCK_AT = 0.5  # predicted toe contact from which a foot is held
RELEASE = 0.075  # share of the hold given up each frame afterwards
HEIGHT_MIX = 0.5
SOLE = (5.0, 4.0)  # centimetres of heel and toe joint above the ground under a standing foot


def leg_joints(skeleton: Skeleton) -> np.ndarray:
    """(2, 4) hip, knee, heel and toe joints of the left leg, then of the right."""
    parts = ("hip", "knee", "heel", "toe")
    return np.array([[skeleton.role(f"{side}_{p}") for p in parts] for side in ("left", "right")])


def sole_heights(network: Network, legs: np.ndarray) -> np.ndarray:
    """(2,) heel and toe height below which a foot is in the ground: SOLE, or less on a rig with lower feet.

    A rig's mean heel and toe heights, of which the mean pose of the network tells, are those of feet that are
    in the air half of the time; 60% of them is below any standing foot.
    """
    layout = network.layout
    height = network.y_mean[layout.y_joint_position].reshape(-1, 3)[:, 1]
    return np.minimum(SOLE, 0.6 * height[legs[:, 2:]].mean(axis=0).astype(float))


@njit(cache=True)
def _turn(rotation: Any, x0: Any, x1: Any) -> None:
    """Turn the world rotation (4,) in place by the least rotation that takes direction x0 to x1."""
    w = np.sqrt((x0 * x0).sum() * (x1 * x1).sum()) + (x0 * x1).sum()
    cx = x0[1] * x1[2] - x0[2] * x1[1]
    cy = x0[2] * x1[0] - x0[0] * x1[2]
    cz = x0[0] * x1[1] - x0[1] * x1[0]
    norm = np.sqrt(w * w + cx * cx + cy * cy + cz * cz)
    if norm < 1e-9:
        return
    w, cx, cy, cz = w / norm, cx / norm, cy / norm, cz / norm
    a, b, c, d = rotation[0], rotation[1], rotation[2], rotation[3]
    rotation[0] = w * a - cx * b - cy * c - cz * d
    rotation[1] = w * b + cx * a + cy * d - cz * c
    rotation[2] = w * c - cx * d + cy * a + cz * b
    rotation[3] = w * d + cx * c - cy * b + cz * a


@njit(cache=True)
def reach(position: Any, rotation: Any, hip: int, knee: int, heel: int, shift: Any) -> None:
    """Move the heel of a pose, positions (J, 3), world rotations (J, 4), by `shift` (3,), bending the knee.

    Bone lengths stay; the knee keeps to the side it bends to; a target out of reach is approached to .1% of
    full stretch (the law of cosines, as `hobble.core.ik.two_bone_knee`). Thigh and shank turn by the least
    amount.
    """
    top = position[hip].copy()
    old_knee, old_heel = position[knee].copy(), position[heel].copy()
    thigh, shank = old_knee - top, old_heel - old_knee
    upper, lower = np.sqrt((thigh * thigh).sum()), np.sqrt((shank * shank).sum())
    way = old_heel + shift - top
    distance = np.sqrt((way * way).sum())
    if distance < 1e-6 or upper < 1e-6 or lower < 1e-6:
        return
    along = way / distance
    distance = min(max(distance, abs(upper - lower) * 1.001 + 1e-6), (upper + lower) * 0.999)
    cosine = (upper * upper + distance * distance - lower * lower) / (2 * upper * distance)
    cosine = min(max(cosine, -1.0), 1.0)
    out = thigh - along * (thigh * along).sum()
    size = np.sqrt((out * out).sum())
    if size < 1e-6:
        return
    position[knee] = top + upper * (along * cosine + out / size * np.sqrt(1 - cosine * cosine))
    position[heel] = top + along * distance
    _turn(rotation[hip], thigh, position[knee] - top)
    _turn(rotation[knee], shank, position[heel] - position[knee])


@njit(cache=True)
def place_feet(
    contact: Any, ground: Any, locking: bool, legs: Any, below: Any, sole: Any,
    lock: Any, hold: Any, lift: Any, position: Any, rotation: Any,
) -> None:  # fmt: skip
    """Hold feet in contact and keep feet out of the ground; changes the pose and the state of the feet.

    contact: (C, 4) predicted left heel, left toe, right heel, right toe; ground: (C, 4) heights under them.
    legs: (2, 4) of `leg_joints`; below: (2, J) bool, joints that a heel carries (the toe);
    sole: (2,) of `sole_heights`.
    lock (C, 2) share of the hold; hold (C, 2, 3) where the toe landed; lift (C, 2) smoothed rise of the heel.
    """
    shift = np.zeros(3)
    for c in range(position.shape[0]):
        for f in range(2):
            hip, knee, heel, toe = legs[f, 0], legs[f, 1], legs[f, 2], legs[f, 3]
            if not locking:
                lock[c, f] = 0.0
            elif contact[c, 2 * f + 1] >= LOCK_AT:
                if lock[c, f] < 1.0:
                    # Where the foot is seen now, so that contact found again midway does not pull it back.
                    hold[c, f] = position[c, toe] + lock[c, f] * (hold[c, f] - position[c, toe])
                lock[c, f] = 1.0
            else:
                lock[c, f] = max(0.0, lock[c, f] - RELEASE)
            shift[0] = lock[c, f] * (hold[c, f, 0] - position[c, toe, 0])
            shift[2] = lock[c, f] * (hold[c, f, 2] - position[c, toe, 2])
            heel_sunk = ground[c, 2 * f] + sole[0] - position[c, heel, 1]
            toe_sunk = ground[c, 2 * f + 1] + sole[1] - position[c, toe, 1]
            lift[c, f] += HEIGHT_MIX * (max(0.0, heel_sunk, toe_sunk) - lift[c, f])
            shift[1] = lift[c, f]
            if abs(shift[0]) + abs(shift[1]) + abs(shift[2]) < 1e-4:
                continue
            before = position[c, heel].copy()
            reach(position[c], rotation[c], hip, knee, heel, shift)
            moved = position[c, heel] - before
            for j in range(position.shape[1]):
                if below[f, j]:
                    position[c, j] += moved


def carried(skeleton: Skeleton, legs: np.ndarray) -> np.ndarray:
    """(2, J) which joints hang below each heel and move with it."""
    out = np.zeros((2, len(skeleton.joints)), bool)
    for f in range(2):
        for j, p in enumerate(skeleton.parents):
            out[f, j] = p == legs[f, 2] or (p >= 0 and out[f, p])
    return out
