"""Rotations of parts of a body from the directions of their bones."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array


def unit(v: Array) -> Array:
    """Vectors (..., 3) of length 1."""
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)


def degrees_between(a: Array, b: Array) -> float:
    """Degrees between two vectors."""
    return float(np.degrees(np.arccos(np.clip(unit(a) @ unit(b), -1.0, 1.0))))


def frame(first: Array, axis: Array, second: Array, other: Array) -> Array:
    """The rotation (4,) that turns `axis` to `first`, and then `other` as near to `second` as possible."""
    return quat.from_matrix(_axes(first, second) @ _axes(axis, other).T)


def _axes(first: Array, second: Array) -> Array:
    x = unit(first)
    y = unit(second - x * (second @ x))
    if np.linalg.norm(y) < 0.5:
        y = unit(np.eye(3)[int(np.argmin(np.abs(x)))] - x * x[int(np.argmin(np.abs(x)))])
    return np.stack([x, y, np.cross(x, y)], axis=1)


def snapped_to_axes(rotation: Array) -> Array:
    """A rotation (4,), made exact if it almost maps the X, Y and Z axes onto one another.

    "Almost" means that each axis comes to within 20 degrees of an axis (in either direction). Any other
    rotation is returned unchanged.
    """
    axes = quat.to_matrix(rotation)
    snapped = np.round(axes)
    near = np.sum(axes * snapped, axis=0).min() > np.cos(np.radians(20))
    if np.all(np.abs(snapped).sum(axis=0) == 1) and near:
        return quat.from_matrix(snapped)
    return rotation


def pointed_along(rotation: Array, axis: Array, bone: Array) -> Array:
    """A rotation (4,), changed as little as possible to turn `axis` to the direction of `bone` (3,)."""
    return quat.mul(quat.between(quat.rotate(rotation, axis), bone), rotation)


def robust_mean(vectors: Array) -> Array:
    """Mean (3,) of vectors (S, 3), without outliers."""
    apart = np.linalg.norm(vectors - np.median(vectors, axis=0), axis=-1)
    return vectors[apart <= 3 * np.median(apart) + 1e-9].mean(axis=0)


def mean_rotation(turns: Array) -> Array:
    """Mean (4,) of rotations (S, 4), without outliers."""
    for _ in range(2):
        _, vectors = np.linalg.eigh(turns.T @ turns)
        mean = vectors[:, -1]
        apart = quat.angle(turns, mean)
        turns = turns[apart <= 2.5 * np.median(apart) + 1e-9]
    return mean


def degrees_between_rotations(a: Array, b: Array) -> float:
    """Degrees between two rotations."""
    return float(np.degrees(quat.angle(a, b)))
