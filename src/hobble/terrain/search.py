"""The search for the patches that fit a cycle best: every patch is tried, most are given up early.

The error of a patch is a sum of terms that only grow as more points are looked at (the spread about the mean
of the points so far never exceeds that of all of them), so a patch whose partial sum is above the worst of
the best so far can be left: what comes out is exactly what trying every patch at every point would give.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.terrain.kernels import search_views, view_errors
from hobble.terrain.patches import Patches

FIRST_POINTS = 128  # points after which most patches can be given up
GOLDEN_RATIO = 0.6180339887498949


@dataclass(frozen=True)
class Footing:
    """What the ground under a cycle has to fit, in patch cells from its middle: u along x, v along z.

    down, up: (N, 3) u, v and height in cm of the soles of feet in contact and of the others, less the mean
    height of those in contact. jumps: whether the ground stays near the feet that are up. beside: (N, 4) u, v
    of a point off the path, and u, v of the point of the path it belongs to; empty but for beams.
    """

    down: Array = field(repr=False)
    up: Array = field(repr=False)
    jumps: bool = False
    beside: Array = field(default_factory=lambda: np.zeros((0, 4), np.float32), repr=False)


def best_patches(patches: Patches, footing: Footing, count: int) -> tuple[np.ndarray, Array]:
    """Indices (count,) of the patches of lowest error, the best first, and their errors (count,) in cm2."""
    found: tuple[np.ndarray, Array] = search_views(  # type: ignore[call-arg]
        *patches.arrays[:-1], _columns(footing), footing.jumps, count
    )
    return found


def patch_errors(patches: Patches, footing: Footing) -> Array:
    """The error (P,) of every patch, in cm2: what `best_patches` finds the lowest of."""
    errors: Array = view_errors(  # type: ignore[call-arg]
        *patches.arrays[:-1], _columns(footing), footing.jumps
    )
    return errors


def _columns(footing: Footing) -> tuple[tuple[Array, ...], ...]:
    """Columns of four tables: in contact, the first FIRST_POINTS in the air, the rest in the air, beside."""
    spread = (np.arange(len(footing.up)) * GOLDEN_RATIO) % 1.0  # so that the first few stand for all
    order = np.argsort(spread, kind="stable")
    up = footing.up[order]
    tables = footing.down, up[:FIRST_POINTS], up[FIRST_POINTS:], footing.beside
    return tuple(tuple(np.ascontiguousarray(column, np.float32) for column in t.T) for t in tables)
