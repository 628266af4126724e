"""The ground under one cycle: the patches that fit it best, each bent to meet the feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hobble.core.quat import Array
from hobble.terrain.correction import Bend, bend, distances, dug_out, stances
from hobble.terrain.patches import Patches
from hobble.terrain.search import Footing, best_patches

PIECE = 8  # frames of a stance that are one point
BESIDE = (35.0, 50.0)  # cm from the path, to each side
NEAREST = 25.0  # cm that these keep from the rest of the path


@dataclass(frozen=True)
class Ground:
    """K fits of one cycle: functions of the ground's x and z.

    chosen, error: (K,) patches and their errors, the best first. centre: (2,) where the patches lie. level: (K,) what is
    added to a patch. surfaces: what is added to meet the contacts. dug: for each fit the places (N, 2) and
    heights (N,) that it is dug out to.
    """

    patches: Patches = field(repr=False)
    chosen: np.ndarray
    error: Array
    centre: Array = field(repr=False)
    level: Array = field(repr=False)
    surfaces: Sequence[Bend] = field(repr=False)
    dug: Sequence[tuple[Array, Array]] = field(default=(), repr=False)

    def at(self, points: Array) -> Array:
        """Heights (K, M) at world points (M, 2) x and z, cm."""
        cells = self.patches.cells(points, self.centre)
        heights = self.patches.at(self.chosen, cells) + self.level[:, None]
        for surface in self.surfaces:
            heights = heights + surface.at(points)
        for k, (places, soles) in enumerate(self.dug):
            heights[k] = dug_out(heights[k], points, places, soles)
        return heights


def fit_cycle(
    patches: Patches,
    soles: Array,
    contacts: Array,
    path: Array,
    sides: Array,
    kind: str,
    *,
    fits: int,
    smoothing: float,
    deepest: float | None,
) -> Ground:
    """Fit the ground under one cycle and the window about it.

    soles: (T, 4, 3) of heels and toes, cm. contacts: (T, 4) bool, some of them true. path: (T, 2) x and z of the
    root; sides: (T, 2) the unit vector to the left. kind: "rocky", "jumpy" or "beam", what
    the error asks for besides. smoothing: of the residual's radial basis functions. deepest: no foot may go
    further below the ground (cm); None asks nothing.
    """
    where, height = soles[..., [0, 2]], soles[..., 1]
    centre, level = where[contacts].mean(axis=0), height[contacts].mean()
    cells = patches.cells(where.reshape(-1, 2), centre).reshape(where.shape)
    table = np.concatenate([cells, (height - level)[..., None]], axis=-1)
    beside = beside_path(patches, path, sides, centre) if kind == "beam" else np.zeros((0, 4))
    footing = Footing(table[contacts], table[~contacts], kind == "jumpy", beside)
    chosen, error = best_patches(patches, footing, fits)
    patch_level = patches.at(chosen, cells[contacts]).mean(axis=1, dtype=float)
    plain = Ground(patches, chosen, error, centre, level - patch_level, ())
    met = meet_contacts(plain, soles, contacts, smoothing)
    return met if deepest is None else let_through(met, soles, deepest)


def meet_contacts(ground: Ground, soles: Array, contacts: Array, smoothing: float) -> Ground:
    """Add the surface of what is left between the ground and the feet in contact."""
    standing = stances(soles, contacts, PIECE)
    residual = standing.height - ground.at(standing.place)
    return replace(ground, surfaces=(bend(standing.place, residual, standing.count, smoothing),))


def let_through(ground: Ground, soles: Array, deepest: float) -> Ground:
    """Dig the ground out where a foot, in contact or not, is below it by more than half of `deepest`."""
    where, height = soles[..., [0, 2]].reshape(-1, 2), soles[..., 1].ravel()
    below = ground.at(where) - height > deepest / 2
    return replace(ground, dug=[(where[row], height[row] + deepest / 2) for row in below])


def beside_path(patches: Patches, path: Array, sides: Array, centre: Array) -> Array:
    """Where there must be no ground beside a beam: (N, 4) cells of a point off the path, and of its point on it."""
    off = np.concatenate([path + sign * d * sides for d in BESIDE for sign in (1, -1)])
    on = np.tile(path, (2 * len(BESIDE), 1))
    free = distances(off, path).min(axis=1) > NEAREST
    return np.concatenate([patches.cells(off[free], centre), patches.cells(on[free], centre)], axis=1)
