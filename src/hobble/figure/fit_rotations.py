"""Joint rotations from joint positions."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

SAME_PLACE = 0.1  # cm; joints that are closer together count as being at the same place


def fitted_rotations(skeleton: Skeleton, positions: Array) -> Array:
    """World rotations (F, J, 4) that turn the bones to the joint positions (F, J, 3) as well as possible.

    A joint with one bone below it starts at the rotation of its parent and turns by the smallest angle to the
    direction of the bone. A joint with several bones below it gets the rotation that fits them best (Kabsch,
    1976). A joint without bones below it turns with its parent.
    """
    rotations = np.tile(quat.IDENTITY, (*positions.shape[:2], 1))
    for j, parent in enumerate(skeleton.parents):
        of_parent = rotations[:, parent] if parent >= 0 else rotations[:, j]
        below = [(k, rest) for k, rest in _bones_below(skeleton, j) if np.linalg.norm(rest) > SAME_PLACE]
        if not below:
            rotations[:, j] = of_parent
        elif len(below) == 1:
            k, rest = below[0]
            now = positions[:, k] - positions[:, j]
            rotations[:, j] = quat.mul(quat.between(quat.rotate(of_parent, rest), now), of_parent)
        else:
            rest = np.array([offset for _, offset in below])
            now = positions[:, [k for k, _ in below]] - positions[:, j, None]
            rotations[:, j] = _kabsch(rest, now)
    return rotations


def _bones_below(skeleton: Skeleton, joint: int) -> list[tuple[int, Array]]:
    """The nearest descendants at another place: (index, vector (3,) from `joint` in the rest pose, cm)."""
    out: list[tuple[int, Array]] = []
    for child in skeleton.children(joint):
        offset = np.asarray(skeleton.offsets[child], float)
        if np.linalg.norm(offset) > SAME_PLACE:
            out.append((child, offset))
        else:
            out += [(k, offset + rest) for k, rest in _bones_below(skeleton, child)]
    return out


def _kabsch(rest: Array, now: Array) -> Array:
    """Rotations (F, 4) that best turn the K vectors `rest` (K, 3) to the vectors `now` (F, K, 3)."""
    u, _, vt = np.linalg.svd(np.einsum("fki,kj->fij", now, rest))
    sign = np.sign(np.linalg.det(u @ vt))
    u[..., -1] *= sign[:, None]  # a mirror image is not a rotation
    return quat.from_matrix(u @ vt)
