"""Finds the patches that fit a gait cycle best. The search tries every patch, but drops most of them soon.

The error of a patch is a sum of terms that are never negative. So a patch can be skipped as soon as its
partial sum exceeds the largest error of the best patches so far. The result equals that of a full search.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array
from hobble.terrain.kernels import search_views, view_errors
from hobble.terrain.patches import Patches

FIRST_POINTS = 128  # positions of feet in the air that are compared first; they rule most patches out
GOLDEN_RATIO = 0.6180339887498949  # the fractional parts of its multiples are spread evenly over 0..1


@dataclass(frozen=True)
class FootPoints:
    """The points that the ground under a cycle has to fit.

    u, v are cells from the middle of the patch, along x and z. down, up: (N, 3) u, v and height of soles in
    contact (down) and in the air (up). Heights are cm above the mean height of the soles in contact. jumps:
    whether the character jumps in the clip, so that the ground must not be far below feet in the air.
    beam_sides: (N, 4) u, v of a point beside the path, and u, v of the nearby point on the path. The
    ground must be far lower at the first point than at the second. Empty unless the ground is a beam.
    """

    down: Array = field(repr=False)
    up: Array = field(repr=False)
    jumps: bool = False
    beam_sides: Array = field(default_factory=lambda: np.zeros((0, 4), np.float32), repr=False)


def best_patches(patches: Patches, footing: FootPoints, count: int) -> tuple[np.ndarray, Array]:
    """Indices (count,) of the patches with the lowest errors, best first, and these errors (count,), cm²."""
    # The last array, the means, is left out: the error does not depend on a constant added to the heights.
    found: tuple[np.ndarray, Array] = search_views(  # type: ignore[call-arg]
        *patches.arrays[:-1], _foot_tables(footing), footing.jumps, count
    )
    return found


def patch_errors(patches: Patches, footing: FootPoints) -> Array:
    """The errors (P,) of all patches, cm²; `best_patches` finds the lowest."""
    errors: Array = view_errors(  # type: ignore[call-arg]
        *patches.arrays[:-1], _foot_tables(footing), footing.jumps
    )
    return errors


def _foot_tables(footing: FootPoints) -> tuple[tuple[Array, ...], ...]:
    """Four tables, each as a tuple of its columns.

    They are the feet in contact, the first FIRST_POINTS feet in the air, the other feet in the air, and
    `beam_sides`. The feet in the air are reordered so that the first ones come from all parts of the cycle.
    """
    spread = (np.arange(len(footing.up)) * GOLDEN_RATIO) % 1.0
    order = np.argsort(spread, kind="stable")
    up = footing.up[order]
    tables = footing.down, up[:FIRST_POINTS], up[FIRST_POINTS:], footing.beam_sides
    return tuple(tuple(np.ascontiguousarray(column, np.float32) for column in table.T) for table in tables)
