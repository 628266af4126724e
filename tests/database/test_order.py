"""The order of a pass: every pair once, nearly equal sections, independent passes."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.database import order


@given(st.integers(1, 50), st.integers(1, 12), st.integers(1, 15))
@settings(max_examples=60, deadline=None)
def test_sections_cut_the_layers_into_near_equal_parts(rows, visits, sections):
    seen = np.zeros((visits, rows), int)
    sizes = []
    for section in range(sections):
        size = rows * visits * (section + 1) // sections - rows * visits * section // sections
        parts = list(order.layer_parts(rows, visits, section, sections, range(size)))
        sizes.append(sum(stop - start for _, start, stop in parts))
        for layer, start, stop in parts:
            assert 0 <= start < stop <= rows
            seen[layer, start:stop] += 1
    assert (seen == 1).all()
    assert max(sizes) - min(sizes) <= 1


@given(st.integers(1, 40), st.integers(0, 99), st.integers(0, 5))
@settings(max_examples=30, deadline=None)
def test_over_all_layers_each_row_uses_each_fit_equally_often(rows, seed, pass_index):
    count = np.random.default_rng(seed).choice([1, 2, 5, 10], rows)
    shown = np.stack([order.pick_fits(count, 10, seed, pass_index, layer, 3) for layer in range(10)], axis=1)
    for fits, of_row in zip(count, shown, strict=True):
        np.testing.assert_array_equal(np.bincount(of_row, minlength=fits), np.full(fits, 10 // fits))


def test_every_layer_has_every_chunk_once_in_a_new_order():
    groups = order.chunk_groups(37, 8, seed=1, pass_index=0, layer=0)
    assert [len(g) for g in groups] == [1, 2, 4, 8, 8, 8, 6]  # the first is soon read
    np.testing.assert_array_equal(np.sort(np.concatenate(groups)), np.arange(37))
    other = order.chunk_groups(37, 8, seed=1, pass_index=0, layer=1)
    assert not np.array_equal(np.concatenate(groups), np.concatenate(other))


def test_the_order_depends_on_seed_pass_layer_and_chunk_only():
    base = order.row_order(1000, 1, 2, 3, 4)
    np.testing.assert_array_equal(base, order.row_order(1000, 1, 2, 3, 4))
    for other in ((9, 2, 3, 4), (1, 9, 3, 4), (1, 2, 9, 4), (1, 2, 3, 9)):
        assert (base == order.row_order(1000, *other)).mean() < 0.02
