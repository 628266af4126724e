"""The filters, against scipy's."""

import numpy as np
import pytest
from scipy import ndimage

from hobble.core.smooth import gaussian, interpolate_curve, lowest, mean, median_of_three, smooth_above


@pytest.mark.parametrize("shape", [(40,), (40, 3), (3, 2), (1,)])
def test_filters_equal_those_of_scipy(shape):
    x = np.random.default_rng(1).normal(size=shape)
    assert gaussian(x, 2.5) == pytest.approx(ndimage.gaussian_filter1d(x, 2.5, axis=0, mode="nearest"))
    assert mean(x, 7) == pytest.approx(ndimage.uniform_filter1d(x, 7, axis=0, mode="nearest"))
    assert (lowest(x, 5) == ndimage.minimum_filter1d(x, 5, axis=0, mode="nearest")).all()
    size = (3,) + (1,) * (x.ndim - 1)
    assert (median_of_three(x) == ndimage.median_filter(x, size, mode="nearest")).all()


def test_the_smooth_curve_above_a_spike_touches_it_and_ends_four_windows_away():
    spike = np.zeros(40)
    spike[20] = 3.0
    found = smooth_above(spike, 2)
    assert np.all(found >= spike - 1e-12)
    assert found[20] == pytest.approx(3.0)
    assert np.flatnonzero(found > 1e-12).tolist() == list(range(12, 29))
    assert smooth_above(np.arange(5.0), 1)[-1] == pytest.approx(4.0)  # the last value is repeated


def test_a_curve_between_frames_is_what_numpy_gives_for_the_whole_curve() -> None:
    rng = np.random.default_rng(1)
    table = rng.normal(size=(50, 3))
    frames = np.arange(50)
    times = [*rng.uniform(-3, 53, 300), 0.0, 48.999, 49.0, 49.5, -0.5, 7.0]
    for curve in (table[:, 1], table[:1, 0]):
        for when in times:
            assert interpolate_curve(curve, when) == np.interp(when, frames[: len(curve)], curve)
    many = np.sort(rng.uniform(20, 30, 12))
    np.testing.assert_array_equal(interpolate_curve(table[:, 2], many), np.interp(many, frames, table[:, 2]))
    assert interpolate_curve(table[:, 2], np.zeros(0)).shape == (0,)
