"""Corrects the patch that was chosen for a gait cycle, so that the ground meets the feet.

First, as in Holden et al. (2017), a surface of radial basis functions is fitted to the residual: the heights
of feet in contact above the ground. This surface is added to the ground. Then, where a foot is still too far
below the ground, a pit is dug: the ground is lowered to a cone around the foot.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.terrain.soles import Mask

WALL_STEEPNESS = 2.0  # least steepness of the walls of a pit, cm per cm
# A surface that leaves too large a residual is fitted again with a quarter of the smoothing, at most this
# many times.
MAX_REFITS = 8


@dataclass(frozen=True)
class Stances:
    """Positions of soles, gathered into N points, for example one for each contact of a foot joint.

    place: (N, 2) x and z, cm. height: (N,) of the sole, cm. count: (N,) number of frames of each point, which
    is its weight.
    """

    place: Array = field(repr=False)
    height: Array = field(repr=False)
    count: Array = field(repr=False)


def gather_stances(soles: Array, contacts: Mask, longest: int) -> Stances:
    """Average the sole of each joint over consecutive frames in contact.

    soles: (T, 4, 3). contacts: (T, 4) bool. longest: at most this many frames become one point;
    longer contacts are cut into several.
    """
    frame, joint = np.nonzero(contacts)
    order = np.lexsort((frame, joint))
    frame, joint = frame[order], joint[order]
    begins = np.ones(len(frame), bool)  # whether a contact begins at this entry
    begins[1:] = (np.diff(frame) != 1) | (np.diff(joint) != 0)
    first = np.flatnonzero(begins)
    contact = np.cumsum(begins) - 1
    frames_since_begin = np.arange(len(frame)) - first[contact]
    point = np.cumsum(begins | (frames_since_begin % longest == 0)) - 1
    count = np.bincount(point)
    positions = soles[frame, joint]
    mean = [np.bincount(point, positions[:, k]) / count for k in range(3)]
    return Stances(np.stack([mean[0], mean[2]], axis=1), mean[1], count.astype(float))


def join_points(a: Stances, b: Stances) -> Stances:
    """The points of `a`, then those of `b`."""
    return Stances(
        np.concatenate([a.place, b.place]),
        np.concatenate([a.height, b.height]),
        np.concatenate([a.count, b.count]),
    )


@dataclass(frozen=True)
class Surface:
    """A surface: the weighted sum of r / spread over N places, where r is the distance from the place.

    places: (N, 2) x and z, cm. weights: (N,). spread: mean distance between the places, cm.
    """

    places: Array = field(repr=False)
    weights: Array = field(repr=False)
    spread: float

    def heights_at(self, points: Array) -> Array:
        """Heights (M,) at points (M, 2)."""
        from hobble.terrain.kernels import distance_sum

        return distance_sum(*_columns(points), *_columns(self.places), self.weights / self.spread)


def fit_surfaces(
    points: Stances, residual: Array, smoothing: float, most: float | None = None, standing: int | None = None
) -> list[Surface]:
    """One surface for each row of `residual` (K, N), the heights that it should have at N points, cm.

    smoothing: regularisation. A point with count m has smoothing / m on the diagonal of the system of
    equations, and the weight m in the mean distance between points. So the surface is exactly that of m
    points at one place.

    most: largest mean difference, cm, that may be left between a surface and its residual; None: no limit. A
    surface that leaves more is fitted again with less smoothing. This happens, for example, if feet stand
    half a metre beside a beam. standing: the mean is taken over the first `standing` points; None: all.
    """
    apart = distances(points.place, points.place)
    spread = float(points.count @ apart @ points.count / points.count.sum() ** 2)
    if spread < 1e-6:  # all points are at one place, so no surface can be fitted
        return [Surface(points.place[:1], np.zeros(1), 1.0)] * len(residual)
    diagonal = smoothing / points.count
    weights = np.linalg.solve(apart / spread - np.diag(diagonal), residual.T).T
    share = points.count[:standing] / points.count[:standing].sum()
    # Indices of the surfaces that may leave too much.
    refit = np.arange(len(residual)) if most is not None else np.zeros(0, int)
    for _ in range(MAX_REFITS):
        # The system of equations is surface - diagonal * weights = residual, so diagonal * weights is left.
        mean_left = np.sum(np.abs(weights[refit] * diagonal)[:, :standing] * share, axis=1)  # cm
        refit = refit[mean_left > (most or 0.0)]
        if not len(refit):
            break
        diagonal = diagonal / 4
        weights[refit] = np.linalg.solve(apart / spread - np.diag(diagonal), residual[refit].T).T
    return [Surface(points.place, w, spread) for w in weights]


@dataclass(frozen=True)
class Pits:
    """Cones with the tip at the bottom, down to which the ground is lowered.

    places: (N, 2) x and z of the tips, cm. heights: (N,) of the tips, cm. steepness: (N,) cm per cm.
    """

    places: Array = field(repr=False)
    heights: Array = field(repr=False)
    steepness: Array = field(repr=False)

    def lower(self, ground: Array, points: Array) -> Array:
        """(M,) at points (M, 2): the lowest of the heights `ground` (M,) and the cones."""
        from hobble.terrain.kernels import lowest_cone

        if not len(self.places):
            return ground
        cones = lowest_cone(*_columns(points), *_columns(self.places), self.heights, self.steepness)
        return np.minimum(ground, cones)


def dig_pits(soles: Array, standing: Stances, depth: float) -> Pits:
    """Pits that lower the ground until soles (N, 3) are only `depth` cm below it.

    The walls of a pit are so steep that the ground under standing feet nearby is not lowered, for example on
    the next step of stairs.
    """
    places, heights = soles[:, [0, 2]], soles[:, 1] + depth
    apart = np.maximum(distances(places, standing.place), 1e-3)
    needed_steepness = ((standing.height - heights[:, None]) / apart).max(axis=1)
    return Pits(places, heights, np.maximum(needed_steepness, WALL_STEEPNESS))


def distances(a: Array, b: Array) -> Array:
    """Distances (M, N) between points a (M, 2) and b (N, 2)."""
    x, z = a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1]
    return np.sqrt(x * x + z * z)


def _columns(points: Array) -> tuple[Array, Array]:
    """The x and z of points (M, 2), each (M,)."""
    return np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
