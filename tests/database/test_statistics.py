"""Statistics compared with plain numpy on all pairs, and the original's groups of columns."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.database.statistics import SILENCING_STD, UNSEEN, Moments, clip_moments, statistics_of_moments
from hobble.rows.clip_rows import ClipRows, pair_batches


def written_out(rows: ClipRows) -> tuple[np.ndarray, np.ndarray]:
    """Every pair as often as in the original, where a flat row has its one fit ten times."""
    x, y = [], []
    for pairs in pair_batches(rows, rows.layout, batch=7):
        times = rows.visits // rows.fits[pairs.row]
        x.append(np.repeat(pairs.x, times, axis=0))
        y.append(np.repeat(pairs.y, times, axis=0))
    return np.concatenate(x).astype(float), np.concatenate(y).astype(float)


@given(st.integers(1, 40), st.integers(0, 99), st.sampled_from([1, 10, None]))
@settings(max_examples=15, deadline=None)
def test_moments_equal_those_of_all_pairs_written_out(rows_of, size, seed, fits):
    rows = rows_of(rows=size, fits=fits, seed=seed)
    for moments, values in zip(clip_moments(rows, rows.layout), written_out(rows), strict=True):
        assert moments.weight == size
        np.testing.assert_allclose(moments.mean, values.mean(0), rtol=1e-6, atol=1e-5)
        np.testing.assert_allclose(moments.std, values.std(0), rtol=1e-6, atol=1e-5)


@given(st.lists(st.integers(0, 9), min_size=1, max_size=6), st.integers(0, 99))
@settings(max_examples=25, deadline=None)
def test_moments_of_parts_add_up_to_those_of_the_whole(cuts, seed):
    rng = np.random.default_rng(seed)
    parts = [rng.normal(1e6, 1.0, (n, 3)) for n in cuts]
    weights = [rng.random(n) + 0.1 for n in cuts]
    total = Moments.of_no_rows(3)
    for part, weight in zip(parts, weights, strict=True):
        total = total + Moments.of_rows(part, weight)
    whole = Moments.of_rows(np.concatenate(parts), np.concatenate(weights))
    assert total.weight == pytest.approx(whole.weight)
    np.testing.assert_allclose(total.mean, whole.mean, rtol=1e-12)
    np.testing.assert_allclose(total.squares, whole.squares, rtol=1e-6, atol=1e-9)


def test_deviations_are_shared_in_the_groups_of_the_original_and_weighted(rows_of, layout):
    rows = rows_of(rows=300, fits=10)
    x, y = clip_moments(rows, rows.layout)
    s = statistics_of_moments(layout, x, y, 0.1, rows.skeleton)
    n = layout.samples
    for start in (0, n, 2 * n, 3 * n):  # tx, tz, dx, dz each on their own
        np.testing.assert_allclose(s.x_std[start : start + n], x.std[start : start + n].mean(), rtol=1e-6)
    for block in (layout.x_gait, layout.x_terrain):
        np.testing.assert_allclose(s.x_std[block], x.std[block].mean(), rtol=1e-6)
    for block in (layout.x_joint_position, layout.x_joint_velocity):
        seen = x.std[block].mean() / 0.1
        expected = np.repeat([seen, seen / UNSEEN, seen], 3)
        np.testing.assert_allclose(s.x_std[block], expected, rtol=1e-6)
    cuts = [0, 2, 3, 4, 8, 20, 32, 41, 50, 59]  # the facts' 0:2, 2, 3, 4:8, 8:20, 20:32, three joint blocks
    for start, stop in pairwise(cuts):
        np.testing.assert_allclose(s.y_std[start:stop], y.std[start:stop].mean(), rtol=1e-6)
    assert cuts[-1] == layout.y_size
    assert all(v.dtype == np.float32 for v in (s.x_mean, s.x_std, s.y_mean, s.y_std))


def test_nothing_is_ever_divided_by_zero(rows_of, layout):
    still = rows_of(rows=20, fits=1)
    for values in (still.x, still.y, still.heights, still.mean, still.channels["injury"]):
        values[...] = 0.0
    s = statistics_of_moments(layout, *clip_moments(still, layout), 0.1, still.skeleton)
    for std in (s.x_std, s.y_std):
        assert (std > 0).all()
        assert np.isfinite(std).all()
    # The ground is always flat, so its heights mean nothing yet.
    assert (s.x_std[layout.x_terrain] == np.float32(SILENCING_STD)).all()
