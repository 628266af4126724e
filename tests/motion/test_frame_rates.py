"""Frame rates of files, and resampling to the rate of clips."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.core import quat
from hobble.motion.edit import resample, sample_times
from hobble.motion.read import frame_rate


def test_the_frame_rate_can_be_set(walk, bvh, make):
    path = bvh(walk, edit=lambda s: s.replace("0.00833333", "0.06666667"))
    wrong, report = make(path)
    assert report["source_fps"] == 15.0
    assert len(wrong) == 961
    right, report = make(path, source_fps=120.0)
    assert report["source_fps"] == 120.0
    np.testing.assert_allclose(right.root, walk.root[::2], atol=1e-6)


@pytest.mark.parametrize(
    ("text", "fps"),
    [
        ("0.008333", 120), ("0.0083333", 120), ("0.00833333", 120), ("0.0166667", 60), ("0.016667", 60),
        ("0.0333333", 30), ("0.0333", 30), ("0.033333", 30), ("0.04", 25), ("0.0416667", 24),
        ("0.02", 50),
        ("0.01", 100), ("0.0111111", 90), ("0.066667", 15), ("8.33333e-3", 120), ("0.005", 200),
    ],
)  # fmt: skip
def test_rounded_frame_times_mean_standard_rates(text, fps):
    assert frame_rate(float(text), text) == pytest.approx(fps, rel=1e-5)


def test_the_film_rate_23_976_is_not_rounded():
    assert frame_rate(0.0417083, "0.0417083") == pytest.approx(23.976, abs=1e-3)


@pytest.mark.parametrize("rate", [24, 25, 30, 50, 90, 120])
def test_resampling_keeps_time_and_rotates_the_shorter_way(walk, rate):
    times = sample_times(len(walk), 120, rate)
    assert len(times) == int(240 * rate / 120) + 1
    new = resample(walk, rate)
    rotations = new.rotations
    assert np.abs(np.linalg.norm(rotations, axis=-1) - 1).max() < 1e-12
    assert np.sum(rotations[1:] * rotations[:-1], axis=-1).min() > 0
    np.testing.assert_allclose(new.root[-1], walk.root[round(times[-1])], atol=1e-9)


def test_halving_the_frame_rate_keeps_frames_exactly(walk):
    times = sample_times(241, 120, 60)
    np.testing.assert_array_equal(times, np.arange(0, 241, 2))
    picked = resample(walk, 60).rotations
    assert np.abs(np.sum(picked * walk.rotations[::2], axis=-1)).min() > 1 - 1e-15


@settings(max_examples=20, deadline=None)
@given(st.integers(1, 50), st.sampled_from([24, 25, 30, 50, 60, 90, 120]), st.sampled_from([30, 60, 120]))
def test_sample_times_lie_in_the_clip(frames, source, target):
    times = sample_times(frames, source, target)
    assert times[0] == 0
    assert times[-1] <= frames - 1
    assert frames - 1 - times[-1] < source / target + 1e-6
    np.testing.assert_allclose(np.diff(times), source / target, atol=1e-9)


def test_angles_that_wrap_at_180_degrees_give_smooth_rotations(walk, bvh, make):
    """The same angles written as 181 and -179 degrees by turns give the same rotations between the frames."""
    spun = replace(walk, rotations=walk.rotations.copy(), root=walk.root * [0, 1, 0])
    spun.rotations[:, 0] = quat.mul(quat.yaw(np.linspace(0, 4 * np.pi, len(walk))), spun.rotations[:, 0])
    clip, report = make(bvh(spun, decimals=6, order="YXZ"), fps=50.0)
    step = quat.angle(clip.rotations[1:], clip.rotations[:-1])
    assert step.max() < 0.5
    assert "Angles jump by up to a whole turn" in report["notes"][0]
    assert "first Hips between frames" in report["notes"][0]
    assert report["repairs"] == []
    assert np.sum(clip.rotations[1:] * clip.rotations[:-1], axis=-1).min() > 0


@pytest.mark.shared
@pytest.mark.parametrize("file", ["cmu/105_16", "cmu/16_21"])
def test_round_trip_120_60_120_stays_within_2_mm(shared, make, file):
    source, _ = make(shared / f"mocap/{file}.bvh", fps=120.0, proportions="clip")
    again = resample(resample(source, 60.0), 120.0)
    apart = np.linalg.norm(again.positions - source.positions[: len(again)], axis=-1)
    assert apart.mean() < 0.2
