"""What a patch still lacks after it was chosen: the ground is bent so that it meets the feet.

First the original's way: the residual at the contacts is added as a surface of radial basis functions. Then, where
a foot is still below the ground, the ground is dug out around it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array

STEEPEST = 2.0  # cm of depth per cm: the walls of what is dug out


@dataclass(frozen=True)
class Stances:
    """Contacts gathered into N points: a foot that stands for 30 frames is one point that counts 30 times.

    place: (N, 2) x and z; height: (N,) of the sole; count: (N,) frames.
    """

    place: Array = field(repr=False)
    height: Array = field(repr=False)
    count: Array = field(repr=False)


def stances(soles: Array, contacts: Array, longest: int) -> Stances:
    """Gather runs of contact of each joint, cut into pieces of at most `longest` frames.

    soles: (T, 4, 3). contacts: (T, 4) bool.
    """
    frame, joint = np.nonzero(contacts)
    order = np.lexsort((frame, joint))
    frame, joint = frame[order], joint[order]
    new = np.ones(len(frame), bool)
    new[1:] = (np.diff(frame) != 1) | (np.diff(joint) != 0)
    first = np.flatnonzero(new)
    run = np.cumsum(new) - 1
    within = np.arange(len(frame)) - first[run]
    piece = np.cumsum(new | (within % longest == 0)) - 1
    count = np.bincount(piece)
    points = soles[frame, joint]
    mean = [np.bincount(piece, points[:, k]) / count for k in range(3)]
    return Stances(np.stack([mean[0], mean[2]], axis=1), mean[1], count.astype(float))


@dataclass(frozen=True)
class Bend:
    """K surfaces of radial basis functions phi(r) = r / spread about the same N places.

    places: (N, 2). weights: (N, K). spread: the mean distance of the places, cm.
    """

    places: Array = field(repr=False)
    weights: Array = field(repr=False)
    spread: float

    def at(self, points: Array) -> Array:
        """Heights (K, M) at points (M, 2)."""
        return (distances(points, self.places) / self.spread @ self.weights).T


def bend(places: Array, residual: Array, count: Array, smoothing: float) -> Bend:
    """The surfaces through `residual` (K, N) at `places` (N, 2), regularised by `smoothing`.

    count: (N,) how many equal points each place stands for. A place that stands for m points has a diagonal of
    smoothing / m, and weighs m in the mean distance: that is exactly what m points at one place come to.
    """
    apart = distances(places, places)
    spread = float(count @ apart @ count / count.sum() ** 2)
    if spread < 1e-6:
        return Bend(places[:1], np.zeros((1, len(residual))), 1.0)
    matrix = apart / spread - np.diag(smoothing / count)
    return Bend(places, np.linalg.solve(matrix, residual.T), spread)


def dug_out(ground: Array, points: Array, feet: Array, soles: Array) -> Array:
    """Ground (M,) at points (M, 2), lowered to let every foot at feet (N, 2) through down to soles (N,)."""
    if not len(feet):
        return ground
    return np.minimum(ground, (distances(points, feet) * STEEPEST + soles).min(axis=1))


def distances(a: Array, b: Array) -> Array:
    """(M, 2) and (N, 2) -> (M, N)."""
    return np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1])
