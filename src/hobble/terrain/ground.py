"""The ground under one cycle: the patches that fit it best, each bent to meet the feet."""

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
    joined,
)
from hobble.terrain.patches import Patches
from hobble.terrain.soles import Mask

STANCE_PIECE = 8  # frames of a stance that are one point
COVERED_PIECE = 4  # likewise of a foot that is below the ground
BESIDE_CM = (35.0, 50.0)  # cm from the path, to each side
PATH_CLEARANCE_CM = 25.0  # cm that these keep from the rest of the path


@dataclass(frozen=True)
class Ground:
    """K fits of one cycle: functions of the ground's x and z.

    patches: None for flat ground. chosen, error: (K,) patches and their errors, the best first. centre: (2,)
    where the patches lie. level: (K,) what is added to a patch. surfaces: for each fit what is added to meet
    the feet. dug: for each fit what is dug out of it.
    """

    patches: Patches | None = field(repr=False)
    chosen: np.ndarray
    error: Array
    centre: Array = field(repr=False)
    level: Array = field(repr=False)
    surfaces: Sequence[Surface] = field(default=(), repr=False)
    dug: Sequence[Pits] = field(default=(), repr=False)

    def at(self, points: Array) -> Array:
        """Heights (K, M) at world points (M, 2) x and z, cm."""
        heights = np.tile(self.level[:, None], len(points))
        if self.patches is not None:
            heights += self.patches.at(self.chosen, self.patches.cells(points, self.centre))
        for k, surface in enumerate(self.surfaces):
            heights[k] += surface.at(points)
        for k, out in enumerate(self.dug):
            heights[k] = out.of(heights[k], points)
        return heights

    def above(self, soles: Array) -> Array:
        """How far the ground is above each sole (..., 3), (K, ...), cm; below it where negative."""
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
    """Fit the ground under one cycle and the window about it.

    soles: (T, 4, 3) of heels and toes, cm. contacts: (T, 4) bool, some of them true. path: (T, 2) x and z
    of the root; sides: (T, 2) the unit vector to the left. kind: "rocky", "jumpy" or "beam", what the error
    asks for besides. smoothing: of the residual's radial basis functions. deepest: no foot may go further
    below the ground (cm); None asks nothing.
    """
    from hobble.terrain.search import Footing, best_patches  # compiled: flat clips need none of it

    where, height = soles[..., [0, 2]], soles[..., 1]
    centre, level = where[contacts].mean(axis=0), height[contacts].mean()
    cells = patches.cells(where.reshape(-1, 2), centre).reshape(where.shape)
    table = np.concatenate([cells, (height - level)[..., None]], axis=-1)
    beside = beside_path(patches, path, sides, centre) if kind == "beam" else np.zeros((0, 4))
    footing = Footing(table[contacts], table[~contacts], kind == "jumpy", beside)
    chosen, error = best_patches(patches, footing, fits)
    patch_level = patches.at(chosen, cells[contacts]).mean(axis=1, dtype=float)
    plain = Ground(patches, chosen, error, centre, level - patch_level)
    return meet_feet(plain, soles, contacts, smoothing, deepest)


def flat_ground(
    soles: Array, contacts: Mask, level: str, *, smoothing: float, deepest: float | None, bent: bool
) -> Ground:
    """Flat ground: one fit. It lies at zero or, if `level` is "feet", at the mean height of soles in contact.

    That is as in the original, whose stretch of frames has no velocity in the last: the contacts of the frame
    before count there once more.

    If `bent`: where a foot is further below it than `deepest` (cm) it is dug out, and where the feet in
    contact are further from it than that on average, since the floor or the capture was uneven, it is bent
    to meet them.
    """
    heights = soles[..., 1]
    held = np.concatenate([contacts[:-1], contacts[-2:-1]])
    zero = heights[held if held.any() else contacts].mean() if level == "feet" else 0.0
    plain = Ground(None, np.array([-1]), np.zeros(1), np.zeros(2), np.array([zero]))
    if deepest is None or not bent:
        return plain
    if np.abs(heights[contacts] - zero).mean() > deepest:
        return meet_feet(plain, soles, contacts, smoothing, deepest)
    return replace(plain, dug=_dug(plain, soles, gather_stances(soles, contacts, STANCE_PIECE), deepest))


def meet_feet(plain: Ground, soles: Array, contacts: Mask, smoothing: float, deepest: float | None) -> Ground:
    """Add the surface of what is left between the ground and the feet in contact, as smooth as leaves no more
    than half of `deepest` on average.

    Feet that are then below the ground (by more than half of `deepest`) join those points, and the surface is
    made again; where it still covers a foot by more than `deepest` it is dug out.
    """
    standing = gather_stances(soles, contacts, STANCE_PIECE)
    residual = standing.height - plain.at(standing.place)
    most = None if deepest is None else deepest / 2
    ground = replace(plain, surfaces=fit_surfaces(standing, residual, smoothing, most))
    if deepest is None:
        return ground
    surfaces = [
        _refitted(plain, k, standing, gather_stances(soles, c & ~contacts, COVERED_PIECE), smoothing, most)
        if c.any()
        else same
        for k, (c, same) in enumerate(zip(ground.above(soles) > deepest / 2, ground.surfaces, strict=True))
    ]
    ground = replace(plain, surfaces=surfaces)
    return replace(ground, dug=_dug(ground, soles, standing, deepest))


def _dug(ground: Ground, soles: Array, standing: Stances, deepest: float) -> list[Pits]:
    """For each fit what lets through the feet that are further below it than `deepest`, to half of that."""
    return [dig_pits(soles[covered], standing, deepest / 2) for covered in ground.above(soles) > deepest]


def _refitted(
    plain: Ground, k: int, standing: Stances, covered: Stances, smoothing: float, most: float | None
) -> Surface:
    """The surface of fit k through the feet in contact and through those that it covered."""
    points = joined(standing, covered)
    residual = points.height - plain.at(points.place)[k]
    return fit_surfaces(points, residual[None], smoothing, most, len(standing.count))[0]


def beside_path(patches: Patches, path: Array, sides: Array, centre: Array) -> Array:
    """(N, 4) cells of points beside the path, where a beam has no ground, and of their points on the path."""
    off = np.concatenate([path + sign * d * sides for d in BESIDE_CM for sign in (1, -1)])
    on = np.tile(path, (2 * len(BESIDE_CM), 1))
    free = distances(off, path).min(axis=1) > PATH_CLEARANCE_CM
    return np.concatenate([patches.cells(off[free], centre), patches.cells(on[free], centre)], axis=1)
