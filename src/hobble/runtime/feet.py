"""Feet on the ground: a foot in contact is held where it landed, and the leg bends to reach (two-bone IK)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from hobble.core.skeleton import Skeleton
from hobble.models.network import Network

# Contact more likely than not. The original waits for .8, and a foot slides 4.8 cm a step before and after.
LOCK_AT = 0.5
RELEASE = 0.075  # share of the hold given up each frame afterwards
TOO_FAR = 20.0  # centimetres the network may want a held foot elsewhere before it is let go
HEIGHT_MIX = 0.5
FLOATING = 3.0  # centimetres above SOLE that a standing foot may be, as rigs differ
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


# Vectors are written out by component below: compiling array expressions takes seconds, and calls allocate.


@njit(cache=True)
def _turn(rotation: Any, ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> None:
    """Turn the world rotation (4,) in place by the least rotation that takes direction a to b."""
    w = np.sqrt((ax * ax + ay * ay + az * az) * (bx * bx + by * by + bz * bz)) + ax * bx + ay * by + az * bz
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    norm = np.sqrt(w * w + x * x + y * y + z * z)
    if norm < 1e-9:
        return
    w, x, y, z = w / norm, x / norm, y / norm, z / norm
    a, b, c, d = rotation[0], rotation[1], rotation[2], rotation[3]
    rotation[0] = w * a - x * b - y * c - z * d
    rotation[1] = w * b + x * a + y * d - z * c
    rotation[2] = w * c - x * d + y * a + z * b
    rotation[3] = w * d + x * c - y * b + z * a


@njit(cache=True)
def reach(
    position: Any, rotation: Any, hip: int, knee: int, heel: int, sx: float, sy: float, sz: float
) -> None:
    """Move the heel of a pose, positions (J, 3), world rotations (J, 4), by (sx, sy, sz), bending the knee.

    Bone lengths stay; the knee keeps to the side it bends to; a target out of reach is approached to .1% of
    full stretch (the law of cosines, as `hobble.core.ik.two_bone_knee`). Thigh and shank turn by the least
    amount.
    """
    hx, hy, hz = position[hip, 0], position[hip, 1], position[hip, 2]
    tx, ty, tz = position[knee, 0] - hx, position[knee, 1] - hy, position[knee, 2] - hz
    lx, ly, lz = position[heel, 0] - hx - tx, position[heel, 1] - hy - ty, position[heel, 2] - hz - tz
    upper, lower = np.sqrt(tx * tx + ty * ty + tz * tz), np.sqrt(lx * lx + ly * ly + lz * lz)
    ax, ay, az = tx + lx, ty + ly, tz + lz
    wx, wy, wz = ax + sx, ay + sy, az + sz
    before, distance = np.sqrt(ax * ax + ay * ay + az * az), np.sqrt(wx * wx + wy * wy + wz * wz)
    if min(before, distance, upper, lower) < 1e-6:
        return
    ax, ay, az = ax / before, ay / before, az / before
    wx, wy, wz = wx / distance, wy / distance, wz / distance
    distance = min(max(distance, abs(upper - lower) * 1.001 + 1e-6), (upper + lower) * 0.999)
    cosine = (upper * upper + distance * distance - lower * lower) / (2 * upper * distance)
    cosine = min(max(cosine, -1.0), 1.0)
    # The knee's side of the leg, turned with the leg: the side seen from the new leg alone may be the back.
    along = tx * ax + ty * ay + tz * az
    ox, oy, oz = tx - along * ax, ty - along * ay, tz - along * az
    turn = (ox * wx + oy * wy + oz * wz) / max(1 + ax * wx + ay * wy + az * wz, 1e-6)
    ox, oy, oz = ox - turn * (ax + wx), oy - turn * (ay + wy), oz - turn * (az + wz)
    size = np.sqrt(ox * ox + oy * oy + oz * oz)
    if size < 1e-6:
        return
    sine = np.sqrt(1 - cosine * cosine) / size
    kx = upper * (wx * cosine + ox * sine)
    ky = upper * (wy * cosine + oy * sine)
    kz = upper * (wz * cosine + oz * sine)
    position[knee, 0], position[knee, 1], position[knee, 2] = hx + kx, hy + ky, hz + kz
    position[heel, 0] = hx + wx * distance
    position[heel, 1] = hy + wy * distance
    position[heel, 2] = hz + wz * distance
    _turn(rotation[hip], tx, ty, tz, kx, ky, kz)
    _turn(rotation[knee], lx, ly, lz, wx * distance - kx, wy * distance - ky, wz * distance - kz)


@njit(cache=True)
def place_feet(
    y: Any, first: int, ground: Any, locking: bool, legs: Any, below: Any, sole: Any,
    lock: Any, hold: Any, lift: Any, position: Any, rotation: Any,
) -> None:  # fmt: skip
    """Hold feet in contact and keep feet out of the ground; changes the pose and the state of the feet.

    y: (C, outputs), whose columns from `first` on are the contacts of left heel, left toe, right heel, right
    toe. ground: (C, 4) heights under them. legs: (2, 4) of `leg_joints`; below: (2, J) bool of `carried`;
    sole: (2,) of `sole_heights`. lock (C, 2) share of the hold; hold (C, 2, 2) x, z where the toe landed;
    lift (C, 2) smoothed rise of the heel.
    """
    for c in range(position.shape[0]):
        for f in range(2):
            hip, knee, heel, toe = legs[f, 0], legs[f, 1], legs[f, 2], legs[f, 3]
            x, z = position[c, toe, 0], position[c, toe, 2]
            away_x, away_z = hold[c, f, 0] - x, hold[c, f, 1] - z
            far = lock[c, f] * np.sqrt(away_x * away_x + away_z * away_z)
            if not locking:
                lock[c, f] = 0.0
            elif y[c, first + 2 * f + 1] >= LOCK_AT and far < TOO_FAR:
                if lock[c, f] < 1.0:
                    # Where the foot is seen now, so that contact found again midway does not pull it back.
                    away_x, away_z = lock[c, f] * away_x, lock[c, f] * away_z
                    hold[c, f, 0], hold[c, f, 1] = x + away_x, z + away_z
                lock[c, f] = 1.0
            else:
                lock[c, f] = max(0.0, lock[c, f] - RELEASE)
            heel_sunk = ground[c, 2 * f] + sole[0] - position[c, heel, 1]
            toe_sunk = ground[c, 2 * f + 1] + sole[1] - position[c, toe, 1]
            # Up out of the ground; down to it too for a foot that should stand and floats.
            rise = max(heel_sunk, toe_sunk)
            rise = max(rise, 0.0) + lock[c, f] * min(rise + FLOATING, 0.0)
            lift[c, f] += HEIGHT_MIX * (rise - lift[c, f])
            away_x, away_z = lock[c, f] * away_x, lock[c, f] * away_z
            if abs(away_x) + abs(away_z) + abs(lift[c, f]) < 1e-4:
                continue
            x, up, z = position[c, heel, 0], position[c, heel, 1], position[c, heel, 2]
            reach(position[c], rotation[c], hip, knee, heel, away_x, lift[c, f], away_z)
            x, up, z = position[c, heel, 0] - x, position[c, heel, 1] - up, position[c, heel, 2] - z
            for j in range(position.shape[1]):
                if below[f, j]:
                    position[c, j, 0] += x
                    position[c, j, 1] += up
                    position[c, j, 2] += z


def carried(skeleton: Skeleton, legs: np.ndarray) -> np.ndarray:
    """(2, J) which joints hang below each heel and move with it."""
    out = np.zeros((2, len(skeleton.joints)), bool)
    for f in range(2):
        for j, p in enumerate(skeleton.parents):
            out[f, j] = p == legs[f, 2] or (p >= 0 and out[f, p])
    return out
