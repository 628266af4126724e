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


def nearest_joints(solids: Sequence[Solid], points: Array, joint_of: Mapping[str, int]) -> NDArray[np.int64]:
    """(V,) the joint that moves the part of the body nearest to each of the points (V, 3).

    joint_of: role in `Solid.owners` -> index of the joint that moves this part of the body.
    """
    nearest, owner = np.full(len(points), np.inf), np.zeros(len(points), np.int64)
    x, y, z = points.T
    for solid in solids:
        if solid.is_subtracted:  # a hole; its surface is moved by the joint of the solid around it
            continue
        low, high = (corner.reshape(3, 1) for corner in solid.bounds())
        # Points more than 4 cm from the box around a solid are nearer to other solids.
        near_box = np.flatnonzero(((low - 4 < points.T) & (high + 4 > points.T)).all(axis=0))
        distance = np.full(len(points), np.inf)
        distance[near_box] = solid.distance(x[near_box], y[near_box], z[near_box])
        nearer = distance < nearest
        joint = np.zeros(len(points), np.int64)
        along = solid.along(points)
        # Each bone moves the points from its `begin` (cm along the solid) to that of the next bone.
        for begin, role in solid.owners:
            joint[along >= begin] = joint_of[role]
        owner[nearer], nearest[nearer] = joint[nearer], distance[nearer]
    return owner


def skin_weights(
    corners: Array, faces: NDArray[np.int64], owner: NDArray[np.int64], reach: float | Array
) -> tuple[NDArray[np.int64], Array]:
    """The joints (V, 4) that move each corner, and their weights (V, 4), largest first. Weights sum to 1.

    corners: (V, 3), faces: (T, 3) of the mesh. owner: (V,) result of `nearest_joints`. At first each corner
    has weight 1 for its owner. Then the weights spread like heat over about `reach` cm (one number, or one
    for each corner). They spread only along the surface, and so never from a thigh to a hand beside it.
    """
    joints = np.unique(owner)
    # (V, number of joints): 1 for the owner of a corner, else 0. The loop below turns them into weights.
    shares = (owner[:, None] == joints).astype(float)
    edges = np.unique(
        np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0
    )
    a, b = edges.T
    length = np.maximum(np.linalg.norm(corners[a] - corners[b], axis=1), 0.05)
    reaches = np.broadcast_to(np.asarray(reach, float), (len(corners),))
    # Conductance of each edge. The more heat flows along the edges, the farther the weights spread.
    flow = (np.minimum(reaches[a], reaches[b]) / length) ** 2 / 6
    count = len(corners)
    graph = coo_array((np.r_[flow, flow], (np.r_[a, b], np.r_[b, a])), (count, count)).tocsr()
    # One implicit step of the heat equation: (1 + sum of the flows of a corner - flows) new = old.
    system = (diags_array(1 + np.asarray(graph.sum(axis=1)).ravel()) - graph).tocsc()
    solve = splu(system).solve
    for _ in range(2):  # two steps, because after one the weights still have a kink at a joint
        shares = solve(shares)
    order = np.argsort(-shares, axis=1)[:, :MOST_BONES]
    weights = np.take_along_axis(shares, order, axis=1)
    if weights.shape[1] < MOST_BONES:
        pad = MOST_BONES - weights.shape[1]
        weights, order = np.pad(weights, ((0, 0), (0, pad))), np.pad(order, ((0, 0), (0, pad)))
    # Only the four largest weights of a corner are kept. So a bone that is fourth at one corner and fifth at
    # the next would suddenly lose its weight. All weights are lowered by 0.01, but not below 0, so that this
    # does not happen to weights of at most 0.01.
    weights = np.maximum(weights - 0.01, 0)
    return joints[order], weights / weights.sum(axis=1, keepdims=True)
