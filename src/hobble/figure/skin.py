"""Skin weights: which bones move each corner (vertex) of a body's mesh, and how much."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu

from hobble.core.quat import Array
from hobble.figure.solids import Solid

MOST_BONES = 4  # at most this many bones move a corner


def owners(solids: Sequence[Solid], points: Array, bones: Mapping[str, int]) -> NDArray[np.int64]:
    """(V,) the joint whose part of the body is nearest to each of the points (V, 3).

    bones: role of an owner (`Solid.owners`) -> index of its joint.
    """
    nearest, owner = np.full(len(points), np.inf), np.zeros(len(points), np.int64)
    x, y, z = points.T
    for solid in solids:
        if solid.cut:
            continue
        low, high = (corner.reshape(3, 1) for corner in solid.bounds())
        # Points more than 4 cm from the box around a solid belong to other solids.
        chosen = np.flatnonzero(((low - 4 < points.T) & (high + 4 > points.T)).all(axis=0))
        away = np.full(len(points), np.inf)
        away[chosen] = solid.distance(x[chosen], y[chosen], z[chosen])
        nearer = away < nearest
        joint = np.zeros(len(points), np.int64)
        along = solid.along(points)
        for begin, role in solid.owners:
            joint[along >= begin] = bones[role]
        owner[nearer], nearest[nearer] = joint[nearer], away[nearer]
    return owner


def spread(
    corners: Array, faces: NDArray[np.int64], owner: NDArray[np.int64], reach: float | Array
) -> tuple[NDArray[np.int64], Array]:
    """The joints (V, 4) that move each corner and their weights (V, 4), largest first. Weights sum to 1.

    corners: (V, 3), faces: (T, 3) of the mesh. At first each corner has weight 1 for its `owner` (V,). Then
    the weights spread like heat over about `reach` cm (one number, or one for each corner). They spread along
    the surface only: none gets from a thigh to a hand that hangs beside it.
    """
    joints = np.unique(owner)
    shares = (owner[:, None] == joints).astype(float)
    edges = np.unique(
        np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0
    )
    a, b = edges.T
    length = np.maximum(np.linalg.norm(corners[a] - corners[b], axis=1), 0.05)
    wide = np.broadcast_to(np.asarray(reach, float), (len(corners),))
    flow = (np.minimum(wide[a], wide[b]) / length) ** 2 / 6
    count = len(corners)
    graph = coo_array((np.r_[flow, flow], (np.r_[a, b], np.r_[b, a])), (count, count)).tocsr()
    system = (diags_array(1 + np.asarray(graph.sum(axis=1)).ravel()) - graph).tocsc()
    solve = splu(system).solve
    for _ in range(2):  # twice, because once leaves a kink in the weights at a joint
        shares = solve(shares)
    order = np.argsort(-shares, axis=1)[:, :MOST_BONES]
    kept = np.take_along_axis(shares, order, axis=1)
    if kept.shape[1] < MOST_BONES:
        pad = MOST_BONES - kept.shape[1]
        kept, order = np.pad(kept, ((0, 0), (0, pad))), np.pad(order, ((0, 0), (0, pad)))
    # All weights are lowered. So the smallest of the four has faded to 0 where another bone replaces it.
    kept = np.maximum(kept - 0.01, 0)
    return joints[order], kept / kept.sum(axis=1, keepdims=True)
