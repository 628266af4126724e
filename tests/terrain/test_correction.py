"""The surface that is added to meet the feet, and the pits."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.terrain.cycle_ground import (
    WALL_STEEPNESS,
    Stances,
    dig_pits,
    distances,
    fit_surfaces,
    gather_stances,
)


def points(seed: int, count: int = 12) -> tuple[Stances, np.ndarray]:
    rng = np.random.default_rng(seed)
    place = rng.uniform(-200, 200, (count, 2))
    return Stances(place, np.zeros(count), np.ones(count)), rng.normal(0, 5, (3, count))


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_without_smoothing_the_surface_goes_through_every_point(seed: int) -> None:
    at, residual = points(seed)
    for surface, wanted in zip(fit_surfaces(at, residual, 0.0), residual, strict=True):
        assert np.allclose(surface.heights_at(at.place), wanted, atol=1e-6)


def test_the_surface_solves_the_regularised_system_of_the_original() -> None:
    at, residual = points(1)
    spread = distances(at.place, at.place).mean()
    phi = distances(at.place, at.place) / spread
    weights = np.linalg.solve(phi - 0.1 * np.eye(12), residual[0])
    elsewhere = np.random.default_rng(5).uniform(-300, 300, (40, 2))
    expected = distances(elsewhere, at.place) / spread @ weights
    assert np.allclose(fit_surfaces(at, residual, 0.1)[0].heights_at(elsewhere), expected)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_only_large_residuals_are_fitted_more_closely_than_in_the_original(seed: int) -> None:
    """Like feet beside a beam: heights differ by half a metre over a short distance."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(-60, 60, (40, 2))
    at = Stances(place, np.zeros(40), rng.integers(1, 9, 40).astype(float))
    residual = np.stack([rng.normal(0, 0.1, 40), rng.choice([0.0, 50.0], 40)])
    once, met = fit_surfaces(at, residual, 0.1), fit_surfaces(at, residual, 0.1, 0.5)
    left = [
        np.abs(r - s.heights_at(place)) @ at.count / at.count.sum()
        for r, s in zip(residual, met, strict=True)
    ]
    assert max(left) <= 0.5 + 1e-9
    assert np.abs(residual[1] - once[1].heights_at(place)) @ at.count / at.count.sum() > 0.5
    assert np.array_equal(once[0].weights, met[0].weights)


def test_stances_are_runs_of_one_joint_of_limited_length() -> None:
    soles = np.zeros((20, 4, 3))
    soles[:, :, 0] = np.arange(4) * 10.0
    soles[:, :, 1] = np.arange(20)[:, None]
    contacts = np.zeros((20, 4), bool)
    contacts[2:7, 0] = True
    contacts[8:10, 0] = True
    contacts[5:10, 3] = True
    found = gather_stances(soles, contacts, longest=3)
    assert found.count.tolist() == [3, 2, 2, 3, 2]
    assert found.place[:, 0].tolist() == [0, 0, 0, 30, 30]
    assert found.height.tolist() == [3, 5.5, 8.5, 6, 8.5]
    assert found.count.sum() == contacts.sum()


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_pits_are_below_the_feet_and_change_nothing_far_away(seed: int) -> None:
    rng = np.random.default_rng(seed)
    soles = rng.uniform(-50, 50, (5, 3)) * [1, 0.1, 1] - [0, 5, 0]
    standing = Stances(rng.uniform(-50, 50, (4, 2)), np.full(4, -20.0), np.ones(4))
    where = np.concatenate([soles[:, [0, 2]], rng.uniform(-100, 100, (50, 2))])
    ground = rng.uniform(0, 5, 55)
    dug = dig_pits(soles, standing, 0.5).lower(ground, where)
    assert np.all(dug[:5] <= soles[:, 1] + 0.5 + 1e-9)
    assert np.all(dug <= ground)
    far = distances(where, soles[:, [0, 2]]).min(axis=1) > 15 / WALL_STEEPNESS
    assert np.array_equal(dug[far], ground[far])
    assert dig_pits(soles[:0], standing, 0.5).lower(ground, where) is ground
