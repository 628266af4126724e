"""Rotations as unit quaternions: arrays (..., 4) of w, x, y, z. The leading axes may be any."""

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
    """Hamilton product (..., 4): the rotation by `b` first, then by `a`."""
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
    # v + w t + cross(u, t), with u = (x, y, z) and t = 2 cross(u, v) = (d, e, f). It is written out, because
    # np.cross takes two to three times as long for the same numbers.
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

    If the directions are opposite, any axis at right angles to `a` gives such a rotation. The axis nearest to
    Y is used, or the one nearest to X if `a` itself is near Y.
    """
    a = np.asarray(a, float) / np.linalg.norm(a, axis=-1, keepdims=True)
    b = np.asarray(b, float) / np.linalg.norm(b, axis=-1, keepdims=True)
    a, b = np.broadcast_arrays(a, b)
    # For the angle t, (1 + cos t, sin t * axis) is a multiple of (cos t/2, sin t/2 * axis).
    w = 1.0 + np.sum(a * b, axis=-1, keepdims=True)
    q = np.concatenate([w, np.cross(a, b)], axis=-1)
    opposite = w[..., 0] < 1e-12
    if np.any(opposite):
        y_or_x = np.where(np.abs(a[..., 1:2]) < 0.9, [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
        axis = y_or_x - a * np.sum(a * y_or_x, axis=-1, keepdims=True)
        q = np.where(opposite[..., None], np.concatenate([np.zeros_like(w), axis], axis=-1), q)
    return normalize(q)


def from_euler(angles: ArrayLike, order: str) -> Array:
    """Rotations (..., 4) from intrinsic Euler angles (..., 3) in radians.

    order: the axes of the three angles, in the order in which a BVH file lists its rotation channels. "ZYX"
    gives R = R_z R_y R_x, where angles[..., 0] is the angle about Z.
    """
    angles = np.asarray(angles, float)
    q = None
    for i, axis in enumerate(order.upper()):
        about_axis = from_axis_angle(np.eye(3)["XYZ".index(axis)], angles[..., i])
        q = about_axis if q is None else mul(q, about_axis)
    assert q is not None
    return q


def to_euler(q: ArrayLike, order: str = "ZYX") -> Array:
    """Intrinsic Euler angles (..., 3) in radians of rotations (..., 4), the inverse of `from_euler`.

    order: three different axes. The middle angle is within +-90 degrees.
    """
    from scipy.spatial.transform import Rotation

    q = np.asarray(q, float)
    flat = Rotation.from_quat(q.reshape(-1, 4), scalar_first=True)
    with warnings.catch_warnings():
        # If the middle angle is +-90 degrees, several triples of angles give the same rotation. Any is right.
        warnings.filterwarnings("ignore", "Gimbal lock")
        return flat.as_euler(order.upper()).reshape(*q.shape[:-1], 3)


def to_matrix(q: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3), which act on column vectors, from quaternions (..., 4)."""
    q = np.asarray(q)
    eye = np.broadcast_to(np.eye(3, dtype=q.dtype), (*q.shape[:-1], 3, 3))
    return np.swapaxes(rotate(q[..., None, :], eye), -1, -2)


def from_matrix(m: ArrayLike) -> Array:
    """Quaternions (..., 4) with w >= 0, from rotation matrices (..., 3, 3).

    The largest of the four components is computed first, and the others from it. This is precise at any angle
    (Shepperd 1978).
    """
    m = np.asarray(m, float)
    a, b, c = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    x, y, z = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    xy, yz, zx = m[..., 0, 1] + m[..., 1, 0], m[..., 1, 2] + m[..., 2, 1], m[..., 2, 0] + m[..., 0, 2]
    # The rows are 4 w q, 4 x q, 4 y q and 4 z q. Each is a multiple of q = (w, x, y, z).
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


def positive(q: ArrayLike, near: ArrayLike = IDENTITY) -> Array:
    """The same rotations (..., 4) with the sign that is nearer to `near` (..., 4): by default w >= 0.

    -q and q are the same rotation.
    """
    q = np.asarray(q)
    return np.where(np.sum(q * near, axis=-1, keepdims=True) < 0, -q, q)


def log(q: ArrayLike, near: ArrayLike = IDENTITY) -> Array:
    """Axis times HALF the angle in radians (..., 3) of rotations (..., 4). q and -q give the same result.

    near: (..., 4). The result jumps where q is half a turn from `near`, and the angle may be more than half a
    turn if `near` is not the identity.
    """
    q = positive(q, near)
    length = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(length, q[..., :1])
    scale = np.where(length > 1e-12, half / np.maximum(length, 1e-12), 1.0)
    return q[..., 1:] * scale


def exp(v: ArrayLike) -> Array:
    """Rotations (..., 4), the inverse of `log`. v: (..., 3) axis times HALF the angle in radians."""
    v = np.asarray(v)
    half = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), v * np.sinc(half / np.pi)], axis=-1)  # np.sinc: sin(half) / half


def slerp(a: ArrayLike, b: ArrayLike, t: ArrayLike) -> Array:
    """Rotations on the shorter arc from `a` (t = 0) to `b` (t = 1).

    a, b: (..., 4). t: a number, or an array that broadcasts against their leading axes.
    """
    a, b = np.asarray(a), np.asarray(b)
    return mul(a, exp(log(mul(inv(a), b)) * np.asarray(t)[..., None]))


def continuous(q: ArrayLike) -> Array:
    """The same rotations (F, ..., 4) without jumps between q and -q from one frame to the next.

    The dot product of successive frames is then never negative.
    """
    q = np.array(q)
    flips = np.sum(q[1:] * q[:-1], axis=-1) < 0
    signs = np.where(np.cumsum(flips, axis=0) % 2 == 1, -1.0, 1.0)
    q[1:] *= signs[..., None]
    return q


def angle(a: ArrayLike, b: ArrayLike) -> Array:
    """Angles (...) in radians, 0 to pi, between rotations `a` and `b`, each (..., 4)."""
    return 2.0 * np.linalg.norm(log(mul(inv(a), b)), axis=-1)


def yaw(angle: ArrayLike) -> Array:
    """Rotations (..., 4) about +Y by `angle` (...) radians. They turn +Z to (sin angle, 0, cos angle)."""
    return from_axis_angle(np.array([0.0, 1.0, 0.0]), angle)
