"""What a patch still lacks after it was chosen: the ground is bent so that it meets the feet.

First the original's way: the residual at the contacts is added as a surface of radial basis functions. Then,
where a foot is still below the ground, the ground is dug out around it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.terrain.soles import Mask

WALL_STEEPNESS = 2.0  # cm of height per cm: the walls of what is dug out
MAX_REFITS = 8  # times, by a quarter each, a surface is made anew that leaves too much


@dataclass(frozen=True)
class Stances:
    """Contacts gathered into N points: a foot that stands for 30 frames is one point that counts 30 times.

    place: (N, 2) x and z; height: (N,) of the sole; count: (N,) frames.
    """

    place: Array = field(repr=False)
    height: Array = field(repr=False)
    count: Array = field(repr=False)


def gather_stances(soles: Array, contacts: Mask, longest: int) -> Stances:
    """Gather the runs of each joint in which `contacts` is true, cut into pieces of at most `longest` frames.

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


def joined(a: Stances, b: Stances) -> Stances:
    """The points of both."""
    return Stances(
        np.concatenate([a.place, b.place]),
        np.concatenate([a.height, b.height]),
        np.concatenate([a.count, b.count]),
    )


@dataclass(frozen=True)
class Surface:
    """A surface of radial basis functions phi(r) = r / spread about N places.

    places: (N, 2) x and z. weights: (N,). spread: the mean distance of the places, cm.
    """

    places: Array = field(repr=False)
    weights: Array = field(repr=False)
    spread: float

    def at(self, points: Array) -> Array:
        """Heights (M,) at points (M, 2)."""
        from hobble.terrain.kernels import distance_sum

        return distance_sum(*_columns(points), *_columns(self.places), self.weights / self.spread)


def fit_surfaces(
    points: Stances, residual: Array, smoothing: float, most: float | None = None, standing: int | None = None
) -> list[Surface]:
    """The surfaces through each row of `residual` (K, N) at N points, regularised by `smoothing`.

    A point that counts m times has a diagonal of smoothing / m, and weighs m in the mean distance: that is
    exactly what m points at one place come to. most: a surface that leaves more than this at the points on
    average (cm), as under feet that stand half a metre beside a beam, is smoothed less. standing: only the
    first so many points are looked at for that.
    """
    apart = distances(points.place, points.place)
    spread = float(points.count @ apart @ points.count / points.count.sum() ** 2)
    if spread < 1e-6:
        return [Surface(points.place[:1], np.zeros(1), 1.0)] * len(residual)
    diagonal = smoothing / points.count
    weights = np.linalg.solve(apart / spread - np.diag(diagonal), residual.T).T
    share = points.count[:standing] / points.count[:standing].sum()
    rough = np.arange(len(residual)) if most is not None else np.zeros(0, int)
    for _ in range(MAX_REFITS):
        left = np.sum(np.abs(weights[rough] * diagonal)[:, :standing] * share, axis=1)  # of the residual
        rough = rough[left > (most or 0.0)]
        if not len(rough):
            break
        diagonal = diagonal / 4
        weights[rough] = np.linalg.solve(apart / spread - np.diag(diagonal), residual[rough].T).T
    return [Surface(points.place, w, spread) for w in weights]


@dataclass(frozen=True)
class Pits:
    """Cones that the ground is dug out to: N places (N, 2), heights (N,) and steepness (N,) in cm per cm."""

    places: Array = field(repr=False)
    heights: Array = field(repr=False)
    steepness: Array = field(repr=False)

    def of(self, ground: Array, points: Array) -> Array:
        """Ground (M,) at points (M, 2), lowered to the cones where it is above them."""
        from hobble.terrain.kernels import lowest_cone

        if not len(self.places):
            return ground
        cones = lowest_cone(*_columns(points), *_columns(self.places), self.heights, self.steepness)
        return np.minimum(ground, cones)


def dig_pits(soles: Array, standing: Stances, depth: float) -> Pits:
    """What lets soles (N, 3) be no more than `depth` cm below the ground.

    As steep as they must be to leave alone the ground under feet that stand beside them, on a step say.
    """
    places, heights = soles[:, [0, 2]], soles[:, 1] + depth
    apart = np.maximum(distances(places, standing.place), 1e-3)
    needed = ((standing.height - heights[:, None]) / apart).max(axis=1)
    return Pits(places, heights, np.maximum(needed, WALL_STEEPNESS))


def distances(a: Array, b: Array) -> Array:
    """(M, 2) and (N, 2) -> (M, N)."""
    x, z = a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1]
    return np.sqrt(x * x + z * z)


def _columns(points: Array) -> tuple[Array, Array]:
    return np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
