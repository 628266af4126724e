"""Clips that play too fast or too slow, by the accelerations of the body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hobble.motion.look import step_count, summarise_clips
from hobble.motion.options import ClipMotion
from hobble.motion.physics import measure_accelerations, times_too_fast


def test_accelerations_grow_with_the_square_of_the_frame_rate(walker, holden31):
    clip = walker(holden31, 601, 120.0)
    once, twice = (measure_accelerations(replace(clip, fps=fps), 10) for fps in (120.0, 240.0))
    assert once is not None
    assert twice is not None
    for name in ("level", "vertical", "falling", "pendulum"):
        assert getattr(twice, name) == pytest.approx(4 * getattr(once, name), rel=1e-9), name
    assert twice.step == once.step
    assert twice.step == pytest.approx(50.0 / holden31.leg_length, rel=0.1)  # 1 m/s, two steps a second
    assert not once.runs


def test_hips_that_are_lowest_over_the_standing_foot_run(walker, holden31):
    clip = walker(holden31, 601, 120.0)
    root = clip.root.copy()
    time = np.arange(len(clip)) / clip.fps
    root[:, 1] -= 3 * np.cos(4 * np.pi * time)
    assert measure_accelerations(replace(clip, root=root), 10).runs


def test_a_child_on_an_adult_skeleton_does_not_play_too_fast(walker, holden31, scaled):
    clip = walker(holden31, 601, 120.0)
    large = scaled(clip, 2.0)
    assert times_too_fast(large, 10, scale=2.0)[1] == pytest.approx(times_too_fast(clip, 10)[1], rel=1e-9)
    assert measure_accelerations(large, 10).level == pytest.approx(
        2 * measure_accelerations(clip, 10).level, rel=1e-9
    )


def test_few_steps_and_short_clips_show_nothing(walker, holden31):
    assert times_too_fast(walker(holden31, 601, 120.0), 2) is None
    assert times_too_fast(walker(holden31, 11, 120.0), 3) is None
    standing = replace(walker(holden31, 60, 60.0), root=np.zeros((60, 3)))
    assert step_count(standing) < 3 or np.isfinite(times_too_fast(standing, step_count(standing))[0])


@pytest.mark.shared
@pytest.mark.parametrize(
    "clip",
    ["07_01", "16_21", *(pytest.param(k, marks=pytest.mark.slow) for k in ("105_29", "02_03", "16_36"))],
)
@pytest.mark.parametrize(("rate", "times"), [(60, 0.5), (120, 1.0), (240, 2.0)])
def test_a_rate_that_is_wrong_by_two_is_noted_with_the_true_rate(shared, root, clip, rate, times):
    file, maps = shared / f"mocap/cmu/{clip}.bvh", root / "config/skeletons"
    (seen,) = summarise_clips(file, maps / "holden31.yaml", maps, ClipMotion(source_fps=float(rate))).clips
    noted = [warning for warning in seen.warnings if "source_fps" in warning]
    assert len(noted) == (times != 1.0)
    assert all(note.endswith("(source_fps: 120).") for note in noted)
