"""Joint rotations from joint positions."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

APART = 0.1  # cm; joints closer together than this count as one place


def fitted_rotations(skeleton: Skeleton, positions: Array) -> Array:
    """World rotations (F, J, 4) with which the bones point as well as possible to the positions (F, J, 3).

    A joint with one joint below it starts at its parent's rotation and turns the shortest way. A joint with
    several gets the best fit to all of them (Kabsch, 1976).
    """
    out = np.tile(quat.IDENTITY, (*positions.shape[:2], 1))
    for j, parent in enumerate(skeleton.parents):
        above = out[:, parent] if parent >= 0 else out[:, j]
        below = [(k, rest) for k, rest in _reached(skeleton, j) if np.linalg.norm(rest) > APART]
        if not below:
            out[:, j] = above
        elif len(below) == 1:
            k, rest = below[0]
            now = positions[:, k] - positions[:, j]
            out[:, j] = quat.mul(quat.between(quat.rotate(above, rest), now), above)
        else:
            rest = np.array([rest for _, rest in below])
            now = positions[:, [k for k, _ in below]] - positions[:, j, None]
            out[:, j] = _kabsch(rest, now)
    return out


def _reached(skeleton: Skeleton, joint: int) -> list[tuple[int, Array]]:
    """The nearest descendants at another place, each with the vector (3,) from the joint to it at rest."""
    out: list[tuple[int, Array]] = []
    for child in skeleton.children(joint):
        offset = np.asarray(skeleton.offsets[child], float)
        if np.linalg.norm(offset) > APART:
            out.append((child, offset))
        else:
            out += [(k, offset + rest) for k, rest in _reached(skeleton, child)]
    return out


def _kabsch(rest: Array, now: Array) -> Array:
    """Rotations (F, 4) that best turn the vectors rest (K, 3) to now (F, K, 3)."""
    u, _, vt = np.linalg.svd(np.einsum("fki,kj->fij", now, rest))
    sign = np.sign(np.linalg.det(u @ vt))
    u[..., -1] *= sign[:, None]
    return quat.from_matrix(u @ vt)
