"""The filters, against scipy's."""

import numpy as np
import pytest
from scipy import ndimage

from hobble.core.smooth import gaussian, lowest, mean, median_of_three, smooth_above


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
