"""The ground under one cycle: the patches that fit it best, corrected to meet the feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hobble.core.quat import Array
from hobble.terrain.correction import (
    Pits,
    Stances,
    Surface,
    dig_pits,
    distances,
    fit_surfaces,
    gather_stances,
    join_points,
)
from hobble.terrain.patches import Patches
from hobble.terrain.soles import Mask

STANCE_FRAMES = 8  # at most this many frames of a stance are averaged to one point
COVERED_FRAMES = 4  # at most this many frames of a foot below the ground are averaged to one point
# This far to the sides of a path on a beam, the ground must be far below the beam.
BEAM_SIDE_CM = (35.0, 50.0)
# Points beside the path are left out if another part of the path is closer than this.
PATH_CLEARANCE_CM = 25.0


@dataclass(frozen=True)
class Ground:
    """The ground of K fits of one cycle.

    patches: all patches; None for flat ground. chosen, error: (K,) indices of the fitted patches and their
    errors, best first. centre: (2,) x and z of the middle of the patches, cm. level: (K,) height that is
    added to each patch, cm. surfaces: for each fit, the surface that is added so that the ground meets
    the feet. pits: for each fit, the pits in the ground. Both may be empty.
    """

    patches: Patches | None = field(repr=False)
    chosen: np.ndarray
    error: Array
    centre: Array = field(repr=False)
    level: Array = field(repr=False)
    surfaces: Sequence[Surface] = field(default=(), repr=False)
    pits: Sequence[Pits] = field(default=(), repr=False)

    def at(self, points: Array) -> Array:
        """Heights (K, M), cm, at world points (M, 2), x and z."""
        heights = np.tile(self.level[:, None], len(points))
        if self.patches is not None:
            heights += self.patches.at(self.chosen, self.patches.cells(points, self.centre))
        for k, surface in enumerate(self.surfaces):
            heights[k] += surface.at(points)
        for k, pit in enumerate(self.pits):
            heights[k] = pit.of(heights[k], points)
        return heights

    def above(self, soles: Array) -> Array:
        """(K, ...) height of the ground above each sole (..., 3), cm; negative if the sole is higher."""
        heights = self.at(soles[..., [0, 2]].reshape(-1, 2))
        return heights.reshape(-1, *soles.shape[:-1]) - soles[..., 1]


def fit_cycle(
    patches: Patches,
    soles: Array,
    contacts: Mask,
    path: Array,
    sides: Array,
    kind: str,
    *,
    fits: int,
    smoothing: float,
    deepest: float | None,
) -> Ground:
    """Fit the ground under one cycle and its window.

    soles: (T, 4, 3) of heels and toes in T frames, cm. contacts: (T, 4) bool, at least one true. path: (T, 2)
    x and z of the root. sides: (T, 2) unit vectors to the left of the path. kind: "rocky", "jumpy" or "beam";
    "jumpy" and "beam" add terms to the error. fits: number of fits. smoothing: regularisation of the surfaces
    that are added. deepest: how far a foot may be below the ground, cm; None: no limit.
    """
    from hobble.terrain.search import (  # here, because it loads compiled code, which flat clips do not need
        FootPoints,
        best_patches,
    )

    where, height = soles[..., [0, 2]], soles[..., 1]
    centre, level = where[contacts].mean(axis=0), height[contacts].mean()
    cells = patches.cells(where.reshape(-1, 2), centre).reshape(where.shape)
    table = np.concatenate([cells, (height - level)[..., None]], axis=-1)
    beam_sides = beam_side_points(patches, path, sides, centre) if kind == "beam" else np.zeros((0, 4))
    footing = FootPoints(table[contacts], table[~contacts], kind == "jumpy", beam_sides)
    chosen, error = best_patches(patches, footing, fits)
    patch_level = patches.at(chosen, cells[contacts]).mean(axis=1, dtype=float)
    plain = Ground(patches, chosen, error, centre, level - patch_level)
    return meet_feet(plain, soles, contacts, smoothing, deepest)


def flat_ground(
    soles: Array, contacts: Mask, level: str, *, smoothing: float, deepest: float | None, correct: bool
) -> Ground:
    """Flat ground, with one fit.

    soles, contacts, smoothing, deepest: see `fit_cycle`. level: "zero", or "feet" for the mean height of the
    soles in contact, as in Holden et al. (2017). They compute contacts from velocities, of which the last
    frame has none. As there, the last frame gets the contacts of the frame before.

    correct: whether to correct the ground. If the feet in contact are more than `deepest` cm from it on
    average (an uneven floor or capture), a surface is added. Otherwise pits are dug under feet that are more
    than `deepest` below the ground.
    """
    heights = soles[..., 1]
    by_velocity = np.concatenate([contacts[:-1], contacts[-2:-1]])
    flat = heights[by_velocity if by_velocity.any() else contacts].mean() if level == "feet" else 0.0
    plain = Ground(None, np.array([-1]), np.zeros(1), np.zeros(2), np.array([flat]))
    if deepest is None or not correct:
        return plain
    if np.abs(heights[contacts] - flat).mean() > deepest:
        return meet_feet(plain, soles, contacts, smoothing, deepest)
    return replace(plain, pits=_pits(plain, soles, gather_stances(soles, contacts, STANCE_FRAMES), deepest))


def meet_feet(plain: Ground, soles: Array, contacts: Mask, smoothing: float, deepest: float | None) -> Ground:
    """Correct the ground so that it meets the feet in contact.

    A smooth surface is fitted to the residual at the contacts, so that at most deepest / 2 is left on
    average. If feet are then more than deepest / 2 below the ground, they are added to the points and the
    surface is fitted again. Feet that are still more than `deepest` below the ground get pits.
    """
    standing = gather_stances(soles, contacts, STANCE_FRAMES)
    residual = standing.height - plain.at(standing.place)
    most = None if deepest is None else deepest / 2
    ground = replace(plain, surfaces=fit_surfaces(standing, residual, smoothing, most))
    if deepest is None:
        return ground
    surfaces = [
        _refitted(plain, k, standing, gather_stances(soles, c & ~contacts, COVERED_FRAMES), smoothing, most)
        if c.any()
        else surface
        for k, (c, surface) in enumerate(zip(ground.above(soles) > deepest / 2, ground.surfaces, strict=True))
    ]
    ground = replace(plain, surfaces=surfaces)
    return replace(ground, pits=_pits(ground, soles, standing, deepest))


def _pits(ground: Ground, soles: Array, standing: Stances, deepest: float) -> list[Pits]:
    """For each fit, the pits for feet that are more than `deepest` below the ground.

    A pit lowers the ground so far that these feet are only deepest / 2 below it.
    """
    return [dig_pits(soles[covered], standing, deepest / 2) for covered in ground.above(soles) > deepest]


def _refitted(
    plain: Ground, k: int, standing: Stances, covered: Stances, smoothing: float, most: float | None
) -> Surface:
    """The surface of fit k, fitted to the feet in contact and to the feet that were below the ground."""
    points = join_points(standing, covered)
    residual = points.height - plain.at(points.place)[k]
    return fit_surfaces(points, residual[None], smoothing, most, len(standing.count))[0]


def beam_side_points(patches: Patches, path: Array, sides: Array, centre: Array) -> Array:
    """(N, 4) points beside a path on a beam, at which the ground has to be far below the beam.

    Columns: u and v of the point, then u and v of the path beside it, in cells from the middle of the patch.
    """
    off = np.concatenate([path + sign * d * sides for d in BEAM_SIDE_CM for sign in (1, -1)])
    on = np.tile(path, (2 * len(BEAM_SIDE_CM), 1))
    free = distances(off, path).min(axis=1) > PATH_CLEARANCE_CM
    return np.concatenate([patches.cells(off[free], centre), patches.cells(on[free], centre)], axis=1)
