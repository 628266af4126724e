"""The error of a patch; the search finds exactly the patches with the lowest errors."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.terrain.heightmaps import TerrainMap
from hobble.terrain.patches import FootPoints, Patches, best_patches, draw_patches, patch_errors

CELL = 3.937007874


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


@pytest.mark.parametrize(("jumps", "points_beside"), [(False, 0), (True, 0), (False, 90), (True, 7)])
def test_the_error_is_that_of_the_formula(patches: Patches, jumps: bool, points_beside: int) -> None:
    for seed in range(6):
        footing = made_up(seed, jumps, points_beside)
        assert np.allclose(
            patch_errors(patches, footing), plain_errors(patches, footing), rtol=2e-4, atol=2e-3
        )


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.booleans(), st.sampled_from([0, 50]), st.integers(1, 20))
def test_the_search_finds_the_lowest_of_all(
    patches: Patches, seed: int, jumps: bool, points_beside: int, count: int
) -> None:
    footing = made_up(seed, jumps, points_beside)
    chosen, error = best_patches(patches, footing, count)
    every = patch_errors(patches, footing)
    assert np.allclose(error, every[chosen], rtol=1e-5, atol=1e-5)
    assert np.allclose(error, np.sort(every)[:count], rtol=1e-5, atol=1e-5)
    assert len(set(chosen.tolist())) == count


def test_feet_on_a_plane_have_no_error_and_feet_below_it_their_depth() -> None:
    slope = TerrainMap("plane", np.add.outer(0.2 * np.arange(200), np.zeros(200)), CELL)
    patches = draw_patches([slope], count=4, cell=CELL, size=128, highest=50.0, seed=1)
    rng = np.random.default_rng(0)
    place = rng.uniform(-60, 60, (90, 2)).astype(np.float32)
    for p in range(4):
        height = patches.heights_at([p], place)[0]
        height = height - height[:40].mean()
        table = np.column_stack([place, height])
        exact = FootPoints(table[:40], table[40:])
        deep = FootPoints(table[:40], table[40:] - np.array([0, 0, 3]))
        high = FootPoints(table[:40], table[40:] + np.array([0, 0, 9]), jumps=True)
        assert patch_errors(patches, exact)[p] == pytest.approx(0, abs=1e-5)
        assert patch_errors(patches, deep)[p] == pytest.approx(9, rel=1e-4)
        assert patch_errors(patches, high)[p] == pytest.approx(16, rel=1e-4)
        bent = table[:40].copy()
        bent[:, 2] += np.where(np.arange(40) % 2, 2, -2)
        assert patch_errors(patches, FootPoints(bent, table[40:]))[p] == pytest.approx(0.4, rel=1e-3)
