"""Inverse kinematics: bends a leg or an arm so that its end reaches a point, and turns single bones."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array


def two_bone_knee(hip: Array, target: Array, pole: Array, upper: float, lower: float) -> tuple[Array, Array]:
    """Positions of knee and ankle, each (..., 3), by the law of cosines. An arm works in the same way.

    hip: (..., 3) position of the hip. target: (..., 3) where the ankle should be. pole: (..., 3) direction in
    which the knee points, of any length; it must not be parallel to the line from hip to target. upper,
    lower: lengths of thigh and shank. If the target is too far away, the leg stretches to 99.9 % of its
    length towards it; if it is too near, the leg folds as far as it can.
    """
    to_target = target - hip
    distance = np.linalg.norm(to_target, axis=-1, keepdims=True)
    along = to_target / np.maximum(distance, 1e-9)
    distance = np.clip(distance, abs(upper - lower) * 1.001 + 1e-6, (upper + lower) * 0.999)
    # Cosine of the angle at the hip, between the thigh and the line from hip to ankle.
    cosine = (upper**2 + distance**2 - lower**2) / (2 * upper * distance)
    cosine = np.clip(cosine, -1.0, 1.0)
    # Direction in which the knee leaves this line: the part of `pole` at right angles to it.
    bend = pole - along * np.sum(pole * along, axis=-1, keepdims=True)
    bend = bend / np.maximum(np.linalg.norm(bend, axis=-1, keepdims=True), 1e-9)
    knee = hip + upper * (along * cosine + bend * np.sqrt(1 - cosine**2))
    return knee, hip + along * distance


def aim_bone(rotation: Array, bone: Array, direction: Array) -> Array:
    """Turn a joint, by the smallest possible angle, so that its bone points in a given direction.

    rotation: (..., 4) of the joint in the world. bone: (..., 3) vector from the joint to the end of the bone,
    in the joint's own axes. direction: (..., 3) in the world. Returns the new world rotation (..., 4).
    """
    return quat.mul(quat.between(quat.rotate(rotation, bone), direction), rotation)
