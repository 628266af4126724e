"""Unit quaternions as arrays (..., 4), w first. All functions take any leading axes."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.floating]

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


def normalize(q: ArrayLike) -> Array:
    """Scale (..., 4) to unit length."""
    q = np.asarray(q)
    return q / np.linalg.norm(q, axis=-1, keepdims=True)


def mul(a: ArrayLike, b: ArrayLike) -> Array:
    """Hamilton product: rotate by `b` first, then by `a`. (..., 4) x (..., 4) -> (..., 4)."""
    a, b = np.asarray(a), np.asarray(b)
    aw, ax, ay, az = a[..., 0], a[..., 1], a[..., 2], a[..., 3]
    bw, bx, by, bz = b[..., 0], b[..., 1], b[..., 2], b[..., 3]
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def inv(q: ArrayLike) -> Array:
    """Inverse of unit quaternions."""
    q = np.asarray(q)
    return q * np.array([1, -1, -1, -1], dtype=q.dtype)


def rotate(q: ArrayLike, v: ArrayLike) -> Array:
    """Rotate vectors (..., 3) by unit quaternions (..., 4)."""
    # Written out, because np.cross takes two to three times as long for the same numbers.
    q, v = np.asarray(q), np.asarray(v)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    a, b, c = v[..., 0], v[..., 1], v[..., 2]
    d, e, f = 2.0 * (y * c - z * b), 2.0 * (z * a - x * c), 2.0 * (x * b - y * a)
    return np.stack(
        [a + w * d + (y * f - z * e), b + w * e + (z * d - x * f), c + w * f + (x * e - y * d)], axis=-1
    )


def from_axis_angle(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Rotations (..., 4) about unit axes (..., 3) by angles (...) in radians."""
    axis, half = np.asarray(axis, float), np.asarray(angle, float)[..., None] / 2
    shape = np.broadcast_shapes(axis.shape[:-1], half.shape[:-1])
    out = np.empty((*shape, 4))
    out[..., :1] = np.cos(half)
    out[..., 1:] = axis * np.sin(half)
    return out


def between(a: ArrayLike, b: ArrayLike) -> Array:
    """The shortest rotation (..., 4) from direction `a` to direction `b`, each (..., 3) of any length.

    For opposite directions, any axis at right angles to `a` would do. The axis nearest to Y is used, or the
    one nearest to X if `a` itself is near Y.
    """
    a = np.asarray(a, float) / np.linalg.norm(a, axis=-1, keepdims=True)
    b = np.asarray(b, float) / np.linalg.norm(b, axis=-1, keepdims=True)
    a, b = np.broadcast_arrays(a, b)
    w = 1.0 + np.sum(a * b, axis=-1, keepdims=True)
    q = np.concatenate([w, np.cross(a, b)], axis=-1)
    opposite = w[..., 0] < 1e-9
    if np.any(opposite):
        side = np.where(np.abs(a[..., 1:2]) < 0.9, [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
        across = side - a * np.sum(a * side, axis=-1, keepdims=True)
        q = np.where(opposite[..., None], np.concatenate([np.zeros_like(w), across], axis=-1), q)
    return normalize(q)


def from_euler(angles: ArrayLike, order: str) -> Array:
    """Rotations (..., 4) from intrinsic Euler angles (..., 3) in radians.

    order: the axes of the three angles, as in the channels of a BVH file: R = R_first R_second R_third. In
    "ZYX" the first axis is Z.
    """
    angles = np.asarray(angles, float)
    q = None
    for i, axis in enumerate(order.upper()):
        step = from_axis_angle(np.eye(3)["XYZ".index(axis)], angles[..., i])
        q = step if q is None else mul(q, step)
    assert q is not None
    return q


def to_euler(q: ArrayLike, order: str = "ZYX") -> Array:
    """Intrinsic Tait-Bryan angles (..., 3) in radians, the inverse of `from_euler`.

    The middle angle is within +-90 degrees.
    """
    from scipy.spatial.transform import Rotation

    q = np.asarray(q, float)
    flat = Rotation.from_quat(q.reshape(-1, 4), scalar_first=True)
    with warnings.catch_warnings():
        # With the middle angle at 90 degrees several triples give the same rotation; any of them is right.
        warnings.filterwarnings("ignore", "Gimbal lock")
        return flat.as_euler(order.upper()).reshape(*q.shape[:-1], 3)


def to_matrix(q: ArrayLike) -> Array:
    """(..., 4) -> rotation matrices (..., 3, 3) that act on column vectors."""
    q = np.asarray(q)
    eye = np.broadcast_to(np.eye(3, dtype=q.dtype), (*q.shape[:-1], 3, 3))
    return np.swapaxes(rotate(q[..., None, :], eye), -1, -2)


def from_matrix(m: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) -> (..., 4), w >= 0.

    The largest of the four components is computed first, and the others from it. This is precise at any angle
    (Shepperd 1978).
    """
    m = np.asarray(m, float)
    a, b, c = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    x, y, z = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    xy, yz, zx = m[..., 0, 1] + m[..., 1, 0], m[..., 1, 2] + m[..., 2, 1], m[..., 2, 0] + m[..., 0, 2]
    rows = np.stack(
        [
            np.stack([1 + a + b + c, x, y, z], axis=-1),
            np.stack([x, 1 + a - b - c, xy, zx], axis=-1),
            np.stack([y, xy, 1 - a + b - c, yz], axis=-1),
            np.stack([z, zx, yz, 1 - a - b + c], axis=-1),
        ],
        axis=-2,
    )
    largest = np.argmax(np.diagonal(rows, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(rows, largest[..., None, None], axis=-2)[..., 0, :]
    return positive(normalize(row))


def positive(q: ArrayLike) -> Array:
    """The same rotations with w >= 0."""
    q = np.asarray(q)
    return np.where(q[..., :1] < 0, -q, q)


def log(q: ArrayLike) -> Array:
    """Axis times HALF the angle in radians, (..., 4) -> (..., 3). q and -q give the same result."""
    q = positive(q)
    length = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(length, q[..., :1])
    scale = np.where(length > 1e-12, half / np.maximum(length, 1e-12), 1.0)
    return q[..., 1:] * scale


def exp(v: ArrayLike) -> Array:
    """Inverse of `log`: (..., 3) -> (..., 4)."""
    v = np.asarray(v)
    half = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), v * np.sinc(half / np.pi)], axis=-1)


def slerp(a: ArrayLike, b: ArrayLike, t: ArrayLike) -> Array:
    """Rotations on the shorter arc from `a` (t = 0) to `b` (t = 1).

    t: broadcasts against the leading axes of `a` and `b`.
    """
    a, b = np.asarray(a), np.asarray(b)
    return mul(a, exp(log(mul(inv(a), b)) * np.asarray(t)[..., None]))


def continuous(q: ArrayLike) -> Array:
    """Quaternions (F, ..., 4) with signs such that the dot product of successive frames is not negative."""
    q = np.array(q)
    flips = np.sum(q[1:] * q[:-1], axis=-1) < 0
    signs = np.where(np.cumsum(flips, axis=0) % 2 == 1, -1.0, 1.0)
    q[1:] *= signs[..., None]
    return q


def angle(a: ArrayLike, b: ArrayLike) -> Array:
    """Angle in radians between two rotations, 0 to pi."""
    return 2.0 * np.linalg.norm(log(mul(inv(a), b)), axis=-1)


def yaw(angle: ArrayLike) -> Array:
    """Rotation about +Y by `angle` radians: takes +Z to (sin, 0, cos)."""
    return from_axis_angle(np.array([0.0, 1.0, 0.0]), angle)
