"""Clips that play too fast or too slow, by the accelerations of the body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hobble.motion.look import summarise_clips
from hobble.motion.options import ClipMotion
from hobble.motion.physics import step_count, times_too_fast


def test_a_clip_at_twice_its_rate_plays_twice_too_fast(walker, holden31):
    clip = walker(holden31, 601, 120.0)
    once, twice = (times_too_fast(replace(clip, fps=fps), 10) for fps in (120.0, 240.0))
    assert once == pytest.approx((1.0, 1.0), rel=0.3)
    assert twice[1] == pytest.approx(2 * once[1], rel=1e-9)


def test_a_child_on_an_adult_skeleton_does_not_play_too_fast(walker, holden31, scaled):
    clip = walker(holden31, 601, 120.0)
    large = scaled(clip, 2.0)
    assert times_too_fast(large, 10, scale=2.0)[1] == pytest.approx(times_too_fast(clip, 10)[1], rel=1e-9)


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
