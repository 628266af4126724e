"""Patches of ground: views of a few heightmaps, drawn at random.

A patch does not store its cells. It stores which heightmap it is from, the affine transform from its cells to
those of the heightmap, and the mean of its heights, which is subtracted from them. 20,000 patches take 1 MB;
their cells would take 600 MB.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hobble.core.declared import ArrayOf, load_declared
from hobble.core.errors import InputError
from hobble.core.files import DELETE_IT, save_npz
from hobble.core.quat import Array
from hobble.terrain.heightmaps import MAX_CELLS, MAX_HEIGHT, TerrainMap

VIEWS_PER_DRAW = 1_000  # random views of a heightmap that are tried at a time
HOLE_HEIGHT = 1e9  # cm; holes in a map get this height, so that views with a hole are dropped
FEWEST_PASSING = 1 / 1_000  # drawing from a map fails if a smaller share of its random views can be used


@dataclass(frozen=True)
class Patches:
    """P views of M heightmaps.

    heights: all maps one after another, row by row, cm, float32. shapes: (M, 2) rows and columns.
    which: (P,) index of each view's map. affine: (P, 2, 3) such that row, column of the map = affine
    (u, v, 1), where (u, v) is a cell counted from the middle of the patch, u along the world's x and v along
    z. mean: (P,) mean height of each view, cm; it is subtracted. cell: width of a patch's cell, cm. size: its
    width, cells.
    """

    heights: Array = field(repr=False)
    shapes: np.ndarray
    which: np.ndarray = field(repr=False)
    affine: Array = field(repr=False)
    mean: Array = field(repr=False)
    cell: float
    size: int

    def __len__(self) -> int:
        return len(self.which)

    @property
    def maps(self) -> tuple[np.ndarray, ...]:
        """Heights, index of each map's first cell (M,), and shapes, as the compiled loops take them."""
        sizes = np.prod(self.shapes, axis=1)
        return self.heights, np.cumsum(sizes) - sizes, self.shapes

    def cells(self, points: Array, centre: Array) -> Array:
        """World points (N, 2), x and z in cm, as cells from the middle of a patch at `centre` (2,).

        Points outside the patch become the nearest cell of its edge.
        """
        half = self.size // 2
        cells = (np.asarray(points) - centre) / self.cell
        return np.clip(cells, -half, self.size - 1 - half).astype(np.float32)

    def heights_at(self, chosen: Sequence[int] | np.ndarray, cells: Array) -> Array:
        """Heights (K, N), cm above the mean of the patch, of K patches at cells (N, 2) from their middle.

        chosen: (K,) indices of the patches.
        """
        from hobble.terrain.kernels import view_heights

        k = np.asarray(chosen, int)
        return view_heights(*self.maps, self.which[k], self.affine[k], self.mean[k], cells)


def draw_patches(
    maps: Sequence[TerrainMap], *, count: int, cell: float, size: int, highest: float, seed: int
) -> Patches:
    """Draw `count` patches of `size` x `size` cells, `cell` cm wide, divided equally among the maps.

    Each patch is a view at a random place, flipped at random and turned by up to 90 degrees either way. A
    view with a height more than `highest` cm from its mean is dropped, and another view is drawn. Raises
    InputError for a map that is too small, or if fewer than one in a thousand of its views can be used.
    """
    counts = [count // len(maps) + (i < count % len(maps)) for i in range(len(maps))]
    drawn = [
        _draw_views(heightmap, views, cell, size, highest, np.random.default_rng([seed, i]))
        for i, (heightmap, views) in enumerate(zip(maps, counts, strict=True))
    ]
    return Patches(
        heights=np.concatenate([np.nan_to_num(m.heights).astype(np.float32).ravel() for m in maps]),
        shapes=np.array([m.heights.shape for m in maps], np.int64),
        which=np.repeat(np.arange(len(maps), dtype=np.int32), counts),
        affine=np.concatenate([affine for affine, _ in drawn]),
        mean=np.concatenate([mean for _, mean in drawn]),
        cell=cell,
        size=size,
    )


def _draw_views(
    heightmap: TerrainMap, count: int, cell: float, size: int, highest: float, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Draw `count` views of one heightmap: their affine maps (count, 2, 3) and mean heights (count,), cm.

    All heights of these views are within `highest` cm of their mean.
    """
    from hobble.terrain.kernels import check_views

    heights = _with_holes_marked(heightmap, cell).astype(np.float32)
    only_map = heights.ravel(), np.zeros(1, np.int64), np.array([heights.shape], np.int64)
    affines, means = [np.zeros((0, 2, 3), np.float32)], [np.zeros(0, np.float32)]
    found, tried = 0, 0
    while found < count:
        affine = _random_views(rng, heightmap, cell, size)
        mean, passes = check_views(*only_map, np.zeros(len(affine), np.int32), affine, size, highest)
        kept = np.flatnonzero(passes)[: count - found]
        affines.append(affine[kept])
        means.append(mean[kept])
        found += len(kept)
        tried += VIEWS_PER_DRAW
        if found < count and found < FEWEST_PASSING * tried:
            problem = (
                f"{found or 'none'} of {tried} random views, {size} cells wide, stay within {highest:g} cm"
            )
            fix = "Lower its height_scale, or leave this heightmap out."
            raise InputError(heightmap.name, f"{problem} of their mean height", fix=fix)
    return np.concatenate(affines), np.concatenate(means)


# What a file of patches holds, for P views of M heightmaps with H cells in all.
DECLARED = {
    "heights": ArrayOf(("H",), low=-MAX_HEIGHT, high=MAX_HEIGHT),
    "shapes": ArrayOf(("M", 2), "iu", 2, MAX_CELLS),
    "which": ArrayOf(("P",), "iu", 0),
    "affine": ArrayOf(("P", 2, 3)),
    "mean": ArrayOf(("P",), low=-MAX_HEIGHT, high=MAX_HEIGHT),
    "cell": ArrayOf((), low=1e-3, high=1e6),
    "size": ArrayOf((), "iu", 1, 2048),
}


def save_patches(path: str | Path, patches: Patches) -> None:
    """Write the heightmaps and their views as one npz."""
    save_npz(path, **{name: np.asarray(getattr(patches, name)) for name in DECLARED})


def load_patches(path: str | Path) -> Patches:
    """Read a file that `save_patches` wrote. Raises InputError if the file is damaged."""
    data = load_declared(path, DECLARED)
    shapes, which, size = data["shapes"].astype(np.int64), data["which"], int(data["size"])
    corners = np.array([[u, v, 1] for u in (-(size // 2), size - 1 - size // 2) for v in (0, size - 1)])
    corners[:, 1] -= size // 2
    if len(data["heights"]) != np.prod(shapes, axis=1).sum() or which.max(initial=0) >= len(shapes):
        raise InputError(path, "its views are not of its heightmaps", fix=DELETE_IT)
    at = data["affine"].astype(float) @ corners.T  # (P, 2, 4) row and column in the heightmap
    if at.min(initial=0) < -0.01 or np.any(at > shapes[which][..., None] - 0.99):
        raise InputError(path, "a view reaches beyond its heightmap", fix=DELETE_IT)
    arrays = {name: data[name] for name in DECLARED if name not in ("cell", "size", "shapes")}
    return Patches(shapes=shapes, cell=float(data["cell"]), size=size, **arrays)


def _with_holes_marked(heightmap: TerrainMap, cell: float) -> Array:
    """The map's heights, with HOLE_HEIGHT in holes (nan) and in the cells around them.

    The cells around a hole are marked, too, because the cells of a coarse patch could skip the hole itself.
    """
    holes = np.isnan(heightmap.heights)
    if not holes.any():
        return heightmap.heights
    from scipy.ndimage import maximum_filter

    reach = 1 + int(np.ceil(cell / heightmap.cell))
    return np.where(maximum_filter(holes, 2 * reach + 1), HOLE_HEIGHT, heightmap.heights)


def _random_views(rng: np.random.Generator, heightmap: TerrainMap, cell: float, size: int) -> Array:
    """The affine maps (N, 2, 3) of at most VIEWS_PER_DRAW random views that lie inside the heightmap."""
    scale = cell / heightmap.cell  # cells of the map for each cell of the view
    half = size // 2
    corners = np.array([[a, b] for a in (-half, size - 1 - half) for b in (-half, size - 1 - half)])
    angle = rng.uniform(-np.pi / 2, np.pi / 2, VIEWS_PER_DRAW)
    flips = rng.choice([-1.0, 1.0], (VIEWS_PER_DRAW, 2))
    place_in_map = rng.uniform(size=(VIEWS_PER_DRAW, 2))
    c, s = np.cos(angle), np.sin(angle)
    turn = scale * np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2) * flips[:, None]
    # The corners of each view relative to its centre, in cells of the map. All must lie inside the map.
    from_centre = np.einsum("nij,kj->nki", turn, corners)
    low, high = -from_centre.min(axis=1), np.array(heightmap.heights.shape) - 1 - from_centre.max(axis=1)
    has_room = np.all(high >= low, axis=1)
    if not has_room.any():
        needed = int(np.ceil((size - 1) * scale)) + 1
        rows, columns = heightmap.heights.shape
        problem = f"{rows} x {columns} cells are too few for patches of {needed} x {needed} of its cells"
        fix = "Use a larger map, a larger `cell` for this map, or a smaller terrain.size."
        raise InputError(heightmap.name, problem, fix=fix)
    centre = low + place_in_map * (high - low)
    return np.concatenate([turn, centre[..., None]], axis=-1)[has_room].astype(np.float32)


# Finds the patches that fit a gait cycle best. The search tries every patch, but drops most of them soon.
#
# The error of a patch is a sum of terms that are never negative. So a patch can be skipped as soon as its
# partial sum exceeds the largest error of the best patches so far. The result equals that of a full search.


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
    from hobble.terrain.kernels import search_views

    # The means are left out: the error does not depend on a constant added to the heights.
    found: tuple[np.ndarray, Array] = search_views(  # type: ignore[call-arg]
        *patches.maps, patches.which, patches.affine, _foot_tables(footing), footing.jumps, count
    )
    return found


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
