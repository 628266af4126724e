"""Patches: views of heightmaps, the rule of 50 cm, and the search for the patches with the lowest errors."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.terrain.heightmaps import TerrainMap
from hobble.terrain.patches import FootPoints, Patches, best_patches, draw_patches

CELL = 3.937007874
SIZE = 128


def plane(a: float, b: float, rows: int = 260, columns: int = 300, cell: float = CELL) -> TerrainMap:
    return TerrainMap("plane", np.add.outer(a * np.arange(rows), b * np.arange(columns)), cell)


def draw(*maps: TerrainMap, count: int = 40, highest: float = 50.0, seed: int = 1) -> Patches:
    return draw_patches(maps, count=count, cell=CELL, size=SIZE, highest=highest, seed=seed)


@settings(max_examples=15, deadline=None)
@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.integers(0, 99))
def test_patches_of_a_plane_are_planes_of_mean_zero(a: float, b: float, seed: int) -> None:
    patches = draw(plane(a, b), count=5, seed=seed)
    points = np.random.default_rng(seed).uniform(-64, 63, (50, 2)).astype(np.float32)
    turn = patches.affine[:, :, :2].astype(float)
    slope = np.einsum("i,pij->pj", [a, b], turn)
    middle = np.array([-0.5, -0.5])  # of the cells -64 .. 63
    expected = np.einsum("pj,nj->pn", slope, points - middle)
    assert np.allclose(patches.heights_at(range(5), points), expected, atol=1e-3)


def test_no_patch_shows_a_hole() -> None:
    """Not even if its cells are four times as wide as those of the map and skip the hole."""
    heights = plane(0.02, 0.02, 800, 800).heights.copy()
    heights[100:-100:150, 100:-100:150] = np.nan
    patches = draw_patches(
        [TerrainMap("holed", heights, CELL / 4)], count=40, cell=CELL, size=32, highest=50.0, seed=1
    )
    points = np.random.default_rng(0).uniform(-16, 15, (40_000, 2)).astype(np.float32)
    at = np.einsum("pij,nj->pin", patches.affine, np.column_stack([points, np.ones(len(points))]))
    seen = at.astype(int)
    for shift in ((0, 0), (0, 1), (1, 0), (1, 1)):
        rows, columns = seen[:, 0] + shift[0], seen[:, 1] + shift[1]
        assert not np.isnan(heights[rows, columns]).any()
    assert np.isfinite(patches.heights).all()


def plain_errors(patches: Patches, footing: FootPoints) -> np.ndarray:
    """The formula of the original, in plain NumPy."""
    every = np.arange(len(patches))

    def at(points: np.ndarray) -> np.ndarray:
        return patches.heights_at(every, points.astype(np.float32)).astype(float)

    down, up, points_beside = footing.down, footing.up, footing.beam_sides
    under = at(down[:, :2])
    level = under.mean(axis=1, keepdims=True)
    error = 0.1 * np.mean((under - level - down[:, 2] + down[:, 2].mean()) ** 2, axis=1)
    over = at(up[:, :2]) - level - up[:, 2] + down[:, 2].mean()
    error += np.mean(np.maximum(over, 0) ** 2, axis=1)
    if footing.jumps:
        error += np.mean(np.maximum(-over - 5, 0) ** 2, axis=1)
    if len(points_beside):
        off, on = at(points_beside[:, :2]), at(points_beside[:, 2:])
        error += np.mean(np.maximum(off - (on - 40), 0) ** 2, axis=1)
    return error


def made_up(seed: int, jumps: bool = False, points_beside: int = 0) -> FootPoints:
    rng = np.random.default_rng(seed)
    n_down, n_up = rng.integers(1, 200), rng.integers(1, 400)
    place = rng.uniform(-64, 63, (n_down + n_up, 2))
    height = rng.normal(0, 8, n_down + n_up)
    height[:n_down] -= height[:n_down].mean()
    height[n_down:] += 8
    table = np.column_stack([place, height])
    off = rng.uniform(-64, 63, (points_beside, 4))
    return FootPoints(table[:n_down], table[n_down:], jumps, off)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.booleans(), st.sampled_from([0, 50]), st.integers(1, 300))
def test_the_search_finds_the_lowest_of_all(
    patches: Patches, seed: int, jumps: bool, points_beside: int, count: int
) -> None:
    footing = made_up(seed, jumps, points_beside)
    chosen, error = best_patches(patches, footing, count)
    every = plain_errors(patches, footing)
    assert np.allclose(error, every[chosen], rtol=2e-4, atol=2e-3)
    assert np.allclose(error, np.sort(every)[:count], rtol=2e-4, atol=2e-3)
    assert len(set(chosen.tolist())) == count
