"""Joint rotations from joint positions."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

SAME_PLACE = 0.1  # cm; joints that are closer together count as being at the same place


def fitted_rotations(skeleton: Skeleton, positions: Array) -> Array:
    """World rotations (F, J, 4) that turn the bones to the joint positions (F, J, 3) as well as possible.

    A joint with one bone starts at the rotation of its parent and turns by the smallest angle to the
    direction of the bone. A joint with several bones gets the rotation that fits them best (Kabsch, 1976). A
    joint without bones below it turns with its parent.
    """
    out = np.tile(quat.IDENTITY, (*positions.shape[:2], 1))
    for j, parent in enumerate(skeleton.parents):
        above = out[:, parent] if parent >= 0 else out[:, j]
        below = [(k, rest) for k, rest in _bones_below(skeleton, j) if np.linalg.norm(rest) > SAME_PLACE]
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


def _bones_below(skeleton: Skeleton, joint: int) -> list[tuple[int, Array]]:
    """(joint, its offset (3,) in the rest pose) of the nearest descendants at another place."""
    out: list[tuple[int, Array]] = []
    for child in skeleton.children(joint):
        offset = np.asarray(skeleton.offsets[child], float)
        if np.linalg.norm(offset) > SAME_PLACE:
            out.append((child, offset))
        else:
            out += [(k, offset + rest) for k, rest in _bones_below(skeleton, child)]
    return out


def _kabsch(rest: Array, now: Array) -> Array:
    """Rotations (F, 4) that best turn the vectors rest (K, 3) to now (F, K, 3)."""
    u, _, vt = np.linalg.svd(np.einsum("fki,kj->fij", now, rest))
    sign = np.sign(np.linalg.det(u @ vt))
    u[..., -1] *= sign[:, None]
    return quat.from_matrix(u @ vt)
