"""Whole clips, the order of heights, flat floors, and the surface that is added to meet the feet."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.labels import LabelOptions
from hobble.labels.label import label_clip
from hobble.motion import ClipMotion
from hobble.motion.make import make_clip
from hobble.motion.root import RootFrames
from hobble.terrain import Terrain
from hobble.terrain.clip_fits import clip_fits, heights_under, sample_points
from hobble.terrain.cycle_ground import distances, fit_surfaces
from hobble.terrain.patches import Patches

from .conftest import database, figure, options, some_patches, walk

GROUNDS = {
    "level": lambda x, z: np.zeros_like(z),
    "slope": lambda x, z: 0.2 * z + 0.05 * x,
    "waves": lambda x, z: 12 * np.sin(z / 70) + 5 * np.sin(x / 9),
    "steps": lambda x, z: 15 * np.clip(np.floor(z / 60) % 6, 0, 4),
}


@pytest.mark.parametrize("kind", ["rocky", "jumpy", "beam"])
@pytest.mark.parametrize("name", GROUNDS)
def test_fitted_ground_meets_the_feet_and_is_never_above_them(patches: Patches, name: str, kind: str) -> None:
    motion, labels = walk(GROUNDS[name])
    fits = clip_fits(motion, labels, patches, kind, options(), database())
    assert fits.patch.shape == (len(labels["cycles"]), 10)
    assert fits.foot_error[..., 0].max() < 1
    assert fits.foot_below.max() <= 1
    assert np.all(np.diff(fits.error, axis=1) >= 0)


def test_heights_of_rows_are_those_of_the_fits_of_their_cycles(patches: Patches) -> None:
    motion, labels = walk(GROUNDS["slope"])
    fits = clip_fits(motion, labels, patches, "rocky", options(), database())
    cycles = labels["cycles"]
    assert fits.frame.tolist() == [f for a, b in cycles for f in range(a, b + 1)]
    assert fits.cycle.tolist() == [c for c, (a, b) in enumerate(cycles) for _ in range(a, b + 1)]
    assert fits.fits.tolist() == [10] * len(fits.frame)
    assert fits.heights.shape == (10 * len(fits.frame), 36)
    assert fits.heights.dtype == np.float32
    centre = fits.heights.reshape(-1, 10, 3, 12)[:, :, 1]
    z = 2.2 * (fits.frame[:, None] + np.arange(-60, 60, 10))
    near = np.abs(np.arange(-60, 60, 10)) <= 30
    assert np.abs(centre - 0.2 * z[:, None])[..., near].mean() < 3


def test_heights_are_ordered_left_centre_right_from_past_to_future() -> None:
    """On ground whose height identifies the place, heights show where they were sampled."""
    frames = 200
    angle = np.linspace(0, 2, frames)
    direction = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=-1)
    position = np.stack([3.0 * np.arange(frames), np.zeros(frames)], axis=-1)
    root = RootFrames(position, direction, np.zeros((frames, 4)), np.zeros(frames - 1))
    samples = sample_points(root, 25.0)
    left = np.stack([np.cos(angle), -np.sin(angle)], axis=-1)  # +X of the facing frame
    assert np.allclose(samples[0], position + 25 * left)
    assert np.allclose(samples[2], position - 25 * left)
    ground = SimpleNamespace(heights_at=lambda points: np.stack([points[:, 0], 7 + points[:, 1]]))
    heights = heights_under(ground, samples, 70, 72, np.arange(-60, 60, 10)).reshape(3, 2, 3, 12)
    for row in range(3):
        for side in range(3):
            at = samples[side, 70 + row + np.arange(-60, 60, 10)]
            assert np.allclose(heights[row, 0, side], at[:, 0])
            assert np.allclose(heights[row, 1, side], 7 + at[:, 1])


@pytest.mark.shared
def test_real_clips_stand_on_the_fitted_ground(shared: Path, root: Path) -> None:
    """Uneven ground, a limp, and the original's own flat clip, whose ground stays at zero."""
    patches = some_patches(2_000)
    skeletons, original = root / "config/skeletons", "pfnn/LocomotionFlat09_000"
    for file, kind in (
        ("cmu/03_04", "rocky"),
        ("cmu/105_16", "flat"),
        (original, "flat"),
        (original, "rocky"),
    ):
        bvh, figure = shared / f"mocap/{file}.bvh", skeletons / "holden31.yaml"
        clip, report = make_clip(bvh, figure, skeletons, bvh.stem, "holden31", ClipMotion())
        labels, _ = label_clip(clip, [], report, "walk", kind, LabelOptions())
        fits = clip_fits(clip, vars(labels), patches, kind, Terrain(), database())
        assert len(fits.frame) > 60, file
        assert fits.foot_error[..., 0].max() < 1, file
        assert fits.foot_below.max() <= 1, file
        if file.startswith("pfnn") and kind == "flat":
            # Its left leg is 2 % shorter than its right one. On equal legs, the feet stand 1.5 cm apart in
            # height, and the ground meets them.
            assert np.abs(fits.heights).max() < 3.5


def test_an_uneven_floor_is_adapted_and_a_foot_below_a_flat_one_makes_only_a_local_pit(
    patches: Patches,
) -> None:
    motion, labels = walk(GROUNDS["waves"])
    fits = clip_fits(motion, labels, patches, "flat", options(), database())
    assert np.all(fits.fits == 1)
    assert np.any(fits.heights != 0)
    assert fits.foot_error[..., 0].max() < 1
    assert fits.foot_below.max() <= 1
    motion, labels = walk(GROUNDS["level"])
    frame = np.flatnonzero(~labels["contacts"][:, 1] & (np.arange(420) > 100))[5]
    feet = motion.positions[:, -4:].copy()
    feet[frame, 1, 1] = 2.5 - 4
    clip = figure(feet, motion.root)
    fits = clip_fits(clip, labels, patches, "flat", options(), database())
    assert np.all(fits.heights == 0)
    assert np.all(fits.patch == -1)
    assert fits.foot_error.max() < 0.01
    assert 0 < fits.foot_below.max() <= 1
    changed = options(deepest=None)
    as_it_is = clip_fits(clip, labels, patches, "flat", changed, database())
    assert as_it_is.foot_below.max() == pytest.approx(4)


def test_the_surface_solves_the_regularised_system_of_the_original() -> None:
    rng = np.random.default_rng(1)
    places, residual = rng.uniform(-200, 200, (12, 2)), rng.normal(0, 5, (1, 12))
    points = np.column_stack([places, np.zeros(12), np.ones(12)])
    spread = distances(places, places).mean()
    weights = np.linalg.solve(distances(places, places) / spread - 0.1 * np.eye(12), residual[0])
    elsewhere = rng.uniform(-300, 300, (40, 2))
    expected = distances(elsewhere, places) / spread @ weights
    assert np.allclose(fit_surfaces(points, residual)[0].heights_at(elsewhere), expected)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000))
def test_only_large_residuals_are_fitted_more_closely_than_in_the_original(seed: int) -> None:
    """Like feet beside a beam: heights differ by half a metre over a short distance."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(-60, 60, (40, 2))
    count = rng.integers(1, 9, 40).astype(float)
    at = np.column_stack([place, np.zeros(40), count])
    residual = np.stack([rng.normal(0, 0.1, 40), rng.choice([0.0, 50.0], 40)])
    once, met = fit_surfaces(at, residual), fit_surfaces(at, residual, 0.5)
    left = [np.abs(r - s.heights_at(place)) @ count / count.sum() for r, s in zip(residual, met, strict=True)]
    assert max(left) <= 0.5 + 1e-9
    assert np.abs(residual[1] - once[1].heights_at(place)) @ count / count.sum() > 0.5
    assert np.array_equal(once[0].weights, met[0].weights)
