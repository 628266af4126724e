"""Frame rates of files, and resampling to the rate of clips."""

import numpy as np
import pytest

from hobble.motion.edit import resample, sample_times
from hobble.motion.read import frame_rate


def test_the_frame_rate_can_be_set(walk, bvh, make):
    path = bvh(walk, edit=lambda s: s.replace("0.00833333", "0.06666667"))
    assert (make(path)[1]["source_fps"], len(make(path)[0])) == (15.0, 961)
    right, report = make(path, source_fps=120.0)
    assert report["source_fps"] == 120.0
    np.testing.assert_allclose(right.root, walk.root[::2], atol=1e-6)


@pytest.mark.parametrize(
    ("text", "fps"),
    [
        ("0.0083333", 120), ("0.0166667", 60), ("0.0333", 30), ("0.04", 25), ("0.0416667", 24), ("0.02", 50),
        ("0.01", 100), ("0.0111111", 90), ("0.066667", 15), ("8.33333e-3", 120), ("0.005", 200),
    ],
)  # fmt: skip
def test_rounded_frame_times_mean_standard_rates(text, fps):
    assert frame_rate(float(text), text) == pytest.approx(fps, rel=1e-5)


@pytest.mark.parametrize("rate", [24, 50, 90])
def test_resampling_keeps_time_and_rotates_the_shorter_way(walk, rate):
    times, new = sample_times(len(walk), 120, rate), resample(walk, rate)
    assert len(times) == len(new) == int(240 * rate / 120) + 1
    assert np.abs(np.linalg.norm(new.rotations, axis=-1) - 1).max() < 1e-12
    assert np.sum(new.rotations[1:] * new.rotations[:-1], axis=-1).min() > 0
    np.testing.assert_allclose(new.root[-1], walk.root[round(times[-1])], atol=1e-9)
