"""Whole clips: exact geometry, the order of heights, flat clips, and errors."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.motion.options import ClipMotion
from hobble.motion.root import RootFrames
from hobble.terrain.clip_fits import clip_fits, heights_under, sample_points, save_fits
from hobble.terrain.cycle_ground import IS_HEEL, find_soles, fit_cycle, heel_above_toe
from hobble.terrain.heightmaps import heightmaps
from hobble.terrain.options import FitOptions, HeightmapOptions
from hobble.terrain.patches import Patches, draw_patches
from tests.terrain.grounds import GROUNDS


@pytest.mark.parametrize("kind", ["rocky", "jumpy", "beam"])
@pytest.mark.parametrize("name", GROUNDS)
def test_fitted_ground_meets_the_feet_and_is_never_above_them(
    made: SimpleNamespace, patches: Patches, name: str, kind: str
) -> None:
    walk = made.walk(GROUNDS[name])
    fits = clip_fits(walk.clip, walk.labels, patches, kind, made.options(), made.database())
    assert fits.patch.shape == (len(walk.labels["cycles"]), 10)
    assert fits.foot_error[..., 0].max() < 1
    assert fits.foot_below.max() <= 1
    assert np.all(np.diff(fits.error, axis=1) >= 0)


def test_patch_and_feet_have_the_same_mean_height(made: SimpleNamespace, patches: Patches) -> None:
    walk = made.walk(GROUNDS["slope"])
    soles = walk.clip.positions[60:200, -4:] - np.array([0.0, 3.0, 0.0])
    contacts, path = walk.labels["contacts"][60:200], walk.clip.root[60:200, [0, 2]]
    sides = np.tile([1.0, 0.0], (len(path), 1))
    ground = fit_cycle(patches, soles, contacts, path, sides, "rocky", FitOptions(fits=5))
    patch = replace(ground, surfaces=(), pits=())
    assert np.allclose(patch.height_above_soles(soles)[:, contacts].mean(axis=1), 0, atol=1e-3)
    assert np.allclose(ground.centre, soles[contacts][:, [0, 2]].mean(axis=0))


def test_heights_of_rows_are_those_of_the_fits_of_their_cycles(
    made: SimpleNamespace, patches: Patches
) -> None:
    walk = made.walk(GROUNDS["slope"])
    fits = clip_fits(walk.clip, walk.labels, patches, "rocky", made.options(), made.database())
    cycles = walk.labels["cycles"]
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


def test_a_clip_without_cycles_has_no_fits(made: SimpleNamespace, patches: Patches, tmp_path: Path) -> None:
    walk = made.walk(GROUNDS["waves"])
    labels = {**walk.labels, "cycles": np.zeros((0, 2), int)}
    for kind in ("flat", "rocky"):
        fits = clip_fits(walk.clip, labels, patches, kind, made.options(), made.database())
        save_fits(tmp_path / "f.npz", fits)
        assert fits.heights.shape == (0, 36)
        assert fits.patch.shape == (0, 10)
        assert len(fits.frame) == len(fits.fits) == 0


def test_labels_of_another_clip_are_refused(made: SimpleNamespace, patches: Patches) -> None:
    walk = made.walk(GROUNDS["level"])
    few = {**walk.labels, "contacts": walk.labels["contacts"][1:]}
    with pytest.raises(
        InputError, match=r"figure: the contacts have shape \(419, 4\), but the clip has 420 frames"
    ):
        clip_fits(walk.clip, few, patches, "rocky", made.options(), made.database())
    late = {**walk.labels, "cycles": np.array([[64, 128], [300, 420]])}
    with pytest.raises(
        InputError, match="frame 300: a cycle has frames 300 to 420, but the clip has 420 frames"
    ):
        clip_fits(walk.clip, late, patches, "rocky", made.options(), made.database())
    with pytest.raises(InputError, match="300 patches are fewer than the 400 fits"):
        clip_fits(walk.clip, walk.labels, patches, "rocky", made.options(fits=400), made.database())


def test_heights_of_joints_above_their_soles(made: SimpleNamespace, holden31: Skeleton) -> None:
    walk = made.walk(GROUNDS["level"])
    contacts, frames = walk.labels["contacts"], np.arange(60, 360)
    flat = find_soles(walk.clip, contacts, frames, True, FitOptions())
    assert (flat.heel_height, flat.toe_height) == (pytest.approx(7.0), pytest.approx(2.5))
    assert np.abs(flat.soles[contacts][:, 1]).max() < 1e-9
    uneven = find_soles(walk.clip, contacts, frames, False, FitOptions())
    assert (uneven.heel_height, uneven.toe_height) == (8.5, 4.0)
    given = find_soles(walk.clip, contacts, frames, True, FitOptions(heel_height=5.0, toe_height=4.5))
    expected = walk.clip.positions[:, -4:, 1] - np.where(IS_HEEL, 5.0, 4.5)
    assert np.allclose(given.soles[..., 1], expected)
    assert heel_above_toe(holden31) == pytest.approx(4.5)


def honest_over(heightmap: dict, files: list[Path], made: SimpleNamespace) -> None:
    """A walk over waves, fitted to patches of one heightmap."""
    options = made.options(patches=100)
    maps = heightmaps([HeightmapOptions(**heightmap)], files, cell=options.cell, height_scale=3.0)
    drawn = options.model_dump(include={"cell", "size", "highest", "seed"})
    patches = draw_patches(maps, count=100, **drawn)
    walk = made.walk(GROUNDS["waves"])
    fits = clip_fits(walk.clip, walk.labels, patches, "rocky", options, made.database())
    assert np.ptp(patches.heights_at(range(100), np.zeros((1, 2), np.float32))) > 1  # it has hills
    assert fits.foot_error[..., 0].max() < 1
    assert fits.foot_below.max() <= 1


def test_real_clips_can_be_fitted_to_a_real_landscape(made: SimpleNamespace) -> None:
    honest_over({"kind": "elevation"}, [], made)


@pytest.mark.shared
def test_real_clips_stand_on_the_fitted_ground(shared: Path, root: Path, made: SimpleNamespace) -> None:
    """Uneven ground, a limp, and the original's own flat clip, whose ground stays at zero."""
    from hobble.labels.label import label_clip
    from hobble.labels.options import LabelOptions
    from hobble.motion.make import make_clip
    from hobble.terrain.options import Terrain

    patches = made.patches(2_000)
    terrain = Terrain()
    skeletons = root / "config/skeletons"
    for file, kind in (
        ("cmu/03_04", "rocky"),
        ("cmu/105_16", "flat"),
        ("pfnn/LocomotionFlat09_000", "flat"),
        ("pfnn/LocomotionFlat09_000", "rocky"),
    ):
        bvh = shared / f"mocap/{file}.bvh"
        clip, report = make_clip(
            bvh,
            skeletons / "holden31.yaml",
            str(skeletons),
            clip=bvh.stem,
            skeleton_name="holden31",
            options=ClipMotion(),
        )
        files = [p for s in (".phase", "_footsteps.txt") if (p := bvh.with_name(bvh.stem + s)).is_file()]
        labels, _ = label_clip(clip, files, report, "walk", kind, LabelOptions())
        arrays = {"contacts": labels.contacts, "cycles": labels.cycles}
        fits = clip_fits(clip, arrays, patches, kind, terrain, made.database())
        assert len(fits.frame) > 60, file
        assert fits.foot_error[..., 0].max() < 1, file
        assert fits.foot_below.max() <= 1, file
        if file.startswith("pfnn") and kind == "flat":
            # Its left leg is 2 % shorter than its right one. On equal legs, the feet stand 1.5 cm apart in
            # height, and the ground meets them.
            assert np.abs(fits.heights).max() < 3.5
