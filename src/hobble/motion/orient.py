"""Computes rotations of body parts from the directions of their bones. Rotations are quaternions (4,)."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array


def unit_vectors(vectors: Array) -> Array:
    """The vectors (..., 3), scaled to length 1. A zero vector stays zero."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-9)


def degrees_between(a: Array, b: Array) -> float:
    """Angle in degrees between two vectors (3,) of any length."""
    return float(np.degrees(np.arccos(np.clip(unit_vectors(a) @ unit_vectors(b), -1.0, 1.0))))


def rotation_aligning(first: Array, from_first: Array, second: Array, from_second: Array) -> Array:
    """The rotation (4,) that turns one direction exactly, and a second one as nearly as possible.

    It turns `from_first` to `first`. Among the rotations that do this, it is the one that turns `from_second`
    nearest to `second`. All are vectors (3,) of any length.
    """
    return quat.from_matrix(_axes(first, second) @ _axes(from_first, from_second).T)


def _axes(first: Array, second: Array) -> Array:
    """(3, 3) matrix whose columns are unit vectors at right angles: x along `first`, y towards `second`."""
    x = unit_vectors(first)
    y = unit_vectors(second - x * (second @ x))
    if np.linalg.norm(y) < 0.5:  # zero, because the two are parallel: take any y at right angles to x
        y = unit_vectors(np.eye(3)[int(np.argmin(np.abs(x)))] - x * x[int(np.argmin(np.abs(x)))])
    return np.stack([x, y, np.cross(x, y)], axis=1)


def snapped_to_axes(rotation: Array) -> Array:
    """The rotation (4,), made exact if it turns each of the X, Y and Z axes to within 20 degrees of an axis.

    The exact rotation turns each axis to the axis that it was near, positive or negative. Any other rotation
    is returned unchanged.
    """
    axes = quat.to_matrix(rotation)
    snapped = np.round(axes)
    near = np.sum(axes * snapped, axis=0).min() > np.cos(np.radians(20))
    if np.all(np.abs(snapped).sum(axis=0) == 1) and near:
        return quat.from_matrix(snapped)
    return rotation


def rotation_pointing_along(rotation: Array, axis: Array, bone: Array) -> Array:
    """The rotation (4,), changed as little as possible so that it turns `axis` to the direction of `bone`.

    axis, bone: vectors (3,).
    """
    return quat.mul(quat.between(quat.rotate(rotation, axis), bone), rotation)


def robust_mean(vectors: Array) -> Array:
    """Mean (3,) of vectors (S, 3), without those that lie unusually far from their median."""
    distances = np.linalg.norm(vectors - np.median(vectors, axis=0), axis=-1)
    return vectors[distances <= 3 * np.median(distances) + 1e-9].mean(axis=0)


def mean_rotation(rotations: Array) -> Array:
    """Mean (4,) of rotations (S, 4), without outliers.

    It is computed twice. The second time, rotations that lie unusually far from the first mean are left out.
    """
    for _ in range(2):
        # The mean of quaternions is the eigenvector with the largest eigenvalue (Markley et al. 2007).
        _, vectors = np.linalg.eigh(rotations.T @ rotations)
        mean = vectors[:, -1]
        angles = quat.angle(rotations, mean)
        rotations = rotations[angles <= 2.5 * np.median(angles) + 1e-9]
    return mean


def degrees_between_rotations(a: Array, b: Array) -> float:
    """Angle in degrees between two rotations (4,)."""
    return float(np.degrees(quat.angle(a, b)))
