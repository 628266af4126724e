"""Patches: views of heightmaps, their means, and the rule of 50 cm."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.core.errors import HobbleError, InputError
from hobble.terrain.heightmaps import TerrainMap
from hobble.terrain.patches import Patches, draw_patches, load_patches, save_patches

CELL = 3.937007874
SIZE = 128
CELLS = np.stack(np.meshgrid(*[np.arange(SIZE) - SIZE // 2] * 2, indexing="ij"), -1).reshape(-1, 2)
CELLS = CELLS.astype(np.float32)


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


def test_every_patch_has_mean_zero_and_no_cell_beyond_the_limit(patches: Patches) -> None:
    heights = patches.heights_at(np.arange(len(patches)), CELLS)
    assert np.abs(heights.mean(axis=1)).max() < 1e-3
    assert np.abs(heights).max() <= 50.001


def test_every_valid_view_can_be_drawn() -> None:
    """On a cliff only views that pass are drawn, whatever part of the cliff they contain."""
    cliff = np.zeros((400, 400))
    cliff[200:] = 60.0
    heights = draw(TerrainMap("cliff", cliff, CELL), count=200).heights_at(range(200), CELLS)
    share = (heights > heights.min(axis=1, keepdims=True) + 30).mean(axis=1)
    spread = np.ptp(heights, axis=1)
    assert np.abs(heights).max() <= 50.001
    assert np.any(spread > 59)
    assert np.all((spread < 50.1) | ((share > 1 / 6 - 0.02) & (share < 5 / 6 + 0.02)))


def test_a_map_with_wider_cells_keeps_its_scale() -> None:
    wide = plane(0.2, 0.0, rows=100, columns=100, cell=4 * CELL)
    patches = draw(wide, count=5)
    slope = np.linalg.norm(patches.affine[:, 0, :2], axis=1) * 0.2
    heights = patches.heights_at(range(5), CELLS)
    assert np.allclose(slope, 0.2 / 4, atol=1e-5)
    assert np.all(np.ptp(heights, axis=1) < 0.2 / 4 * 128 * 1.5)


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


def test_patches_round_trip_and_are_small(tmp_path: Path, patches: Patches) -> None:
    save_patches(tmp_path / "p.npz", patches)
    back = load_patches(tmp_path / "p.npz")
    assert np.array_equal(back.heights_at(range(9), CELLS), patches.heights_at(range(9), CELLS))
    views = sum(getattr(patches, n).nbytes for n in ("which", "affine", "mean"))
    assert views / len(patches) * 20_000 < 1e6


def test_maps_without_patches_are_refused_by_name() -> None:
    with pytest.raises(
        InputError, match="plane: none of 1000 random views, 128 cells wide, stay within 50 cm"
    ):
        draw(plane(0, 0), plane(3, 3))
    with pytest.raises(InputError, match="plane: 90 x 300 cells are too few for patches of 128 x 128"):
        draw(plane(0, 0, rows=90))
    with pytest.raises(HobbleError, match="heightmaps is empty"):
        draw()
