"""The filters, against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from hobble.core.smooth import gaussian, lowest, mean, median_of_three


@pytest.mark.parametrize("shape", [(40,), (40, 3), (3, 2), (1,)])
def test_filters_equal_those_of_scipy(shape):
    x = np.random.default_rng(1).normal(size=shape)
    assert gaussian(x, 2.5) == pytest.approx(ndimage.gaussian_filter1d(x, 2.5, axis=0, mode="nearest"))
    assert mean(x, 7) == pytest.approx(ndimage.uniform_filter1d(x, 7, axis=0, mode="nearest"))
    assert (lowest(x, 5) == ndimage.minimum_filter1d(x, 5, axis=0, mode="nearest")).all()
    size = (3,) + (1,) * (x.ndim - 1)
    assert (median_of_three(x) == ndimage.median_filter(x, size, mode="nearest")).all()
