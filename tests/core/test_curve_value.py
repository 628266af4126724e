from __future__ import annotations

import numpy as np

from hobble.core.smooth import interpolate_curve


def test_it_is_what_numpy_gives_for_the_whole_curve() -> None:
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
