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
    """(4,) the rotation that turns `axis` to `first`, and `other` as near as possible to `second`."""
    return quat.from_matrix(_axes(first, second) @ _axes(axis, other).T)


def _axes(first: Array, second: Array) -> Array:
    x = unit(first)
    y = unit(second - x * (second @ x))
    if np.linalg.norm(y) < 0.5:
        y = unit(np.eye(3)[int(np.argmin(np.abs(x)))] - x * x[int(np.argmin(np.abs(x)))])
    return np.stack([x, y, np.cross(x, y)], axis=1)


def snapped_to_axes(frame: Array) -> Array:
    """The rotation `frame` (4,), or the nearest one that permutes the axes if it is within 20 degrees."""
    axes = quat.to_matrix(frame)
    whole = np.round(axes)
    if np.all(np.abs(whole).sum(axis=0) == 1) and np.sum(axes * whole, axis=0).min() > np.cos(np.radians(20)):
        return quat.from_matrix(whole)
    return frame


def pointed_along(whole: Array, axis: Array, bone: Array) -> Array:
    """The rotation `whole` (4,), changed as little as possible so that it turns `axis` to the bone."""
    return quat.mul(quat.between(quat.rotate(whole, axis), bone), whole)


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
