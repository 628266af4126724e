"""Processes that share a section read each sample once, in the batches that one process would take."""

from __future__ import annotations

from itertools import accumulate, chain, pairwise, product

import numpy as np
import pytest

from hobble.database.order import SampleRange, SectionSharing


def read(sharing: SectionSharing) -> list[list[int]]:
    """The numbers of the samples in the section that a process reads for each batch."""
    pieces = []
    for stretch in sharing.own_stretches():
        numbers = np.arange(stretch.start, stretch.stop)[stretch.own_samples(0, stretch.stop - stretch.start)]
        assert len(numbers) == stretch.rows
        size = stretch.high - stretch.low
        pieces.append([numbers[at : at + size].tolist() for at in range(0, len(numbers), size)])
    sizes = list(sharing.batch_sizes())
    batches = [list(chain(*(piece[i] for piece in pieces if i < len(piece)))) for i in range(len(sizes))]
    assert [len(batch) for batch in batches] == [own for _, own in sizes]
    return batches


@pytest.mark.parametrize("total", [1, 7, 64, 65, 95, 96, 97, 1000])
@pytest.mark.parametrize(("batch", "most"), [(1, 1), (6, 4), (32, 5)])
def test_a_batch_depends_only_on_the_number_of_ranges(total, batch, most):
    for stretches, processes in product(range(1, most + 1), repeat=2):
        alone = read(SectionSharing.for_process(total, batch, stretches))
        assert sorted(chain(*alone)) == list(range(total))
        assert [len(b) for b in alone] == [min(batch, total - at) for at in range(0, total, batch)]
        shared = [
            read(SectionSharing.for_process(total, batch, stretches, rank, processes))
            for rank in range(processes)
        ]
        assert [list(chain(*parts)) for parts in zip(*shared, strict=True)] == alone


def test_with_one_range_samples_keep_the_order_of_the_section():
    assert list(chain(*read(SectionSharing.for_process(95, 32)))) == list(range(95))


def test_with_as_many_ranges_as_processes_each_reads_its_own_range():
    found = [SectionSharing.for_process(1000, 32, 4, rank, 4).own_stretches() for rank in range(4)]
    assert all(len(stretches) == 1 for stretches in found)
    assert [s.high - s.low for (s,) in found] == [s.share for (s,) in found] == [8] * 4
    edges = [(s.start, s.stop) for (s,) in found]
    assert edges == [(0, 256), (256, 504), (504, 752), (752, 1000)]


def test_the_samples_of_a_range_do_not_depend_on_the_blocks_that_are_read():
    stretch = SampleRange(10, 33, 5, 1, 4)
    whole = np.arange(23)[stretch.own_samples(0, 23)]
    cuts = list(accumulate([0, 3, 9, 1, 10]))
    parts = [np.arange(a, b)[stretch.own_samples(a, b - a)] for a, b in pairwise(cuts)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert len(whole) == stretch.rows == 14
