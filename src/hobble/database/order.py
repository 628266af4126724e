"""The order in which a pass over the data visits rows and their terrain fits.

The functions keep no state. The order depends only on their arguments, such as the seed.

Rows are stored in chunks (files). Each row has one or more terrain fits (ground heights that suit its
motion).

A pass visits every row `visits` times. It consists of `visits` layers. A layer visits every row once, with
one of the row's fits. Each pass permutes the fits of every row anew. In layer l, a row with n fits has the
fit at place l % n of its permutation. So a row with `visits` fits has each of them once in a pass. A row on
flat ground has only one fit, which comes in every layer. All visits of a pass, layer after layer, are cut
into sections of nearly equal length. With `visits` sections, each section is a layer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

# What random numbers are drawn for. This is part of the generator's seed, so that each purpose gets other
# numbers.
CHUNKS, ROWS, FITS = 1, 2, 3


def random_generator(seed: int, *purpose: int) -> np.random.Generator:
    """A new random generator, whose numbers depend only on the arguments.

    seed: the seed in the configuration. purpose: CHUNKS, ROWS or FITS, then numbers of pass, layer etc.
    """
    return np.random.default_rng([seed, *purpose])


def layer_parts(
    rows: int, visits: int, section: int, sections: int, part: tuple[int, int] | None = None
) -> Iterator[tuple[int, int, int]]:
    """Yield the parts of layers of which a section consists, as (layer, first place, last place + 1).

    rows: number of rows in a layer. visits: number of layers. section: number of the section, from 0.
    sections: number of all sections. part: (start, stop), the visits of the section to yield; None: all.
    """
    total = rows * visits
    start, stop = total * section // sections, total * (section + 1) // sections
    if part is not None:
        start, stop = start + part[0], min(stop, start + part[1])
    while start < stop:
        layer = start // rows
        end = min(stop, (layer + 1) * rows)
        yield layer, start - layer * rows, end - layer * rows
        start = end


def chunk_groups(chunks: int, window: int, seed: int, pass_index: int, layer: int) -> list[np.ndarray]:
    """Groups of chunks, in the order of a layer. Each is an array with the numbers of its chunks.

    The chunks of a group are read together, and their rows are mixed. chunks: number of all chunks. window:
    largest number of chunks of a group. The first group has one chunk, and each further group has twice as
    many as the group before, up to `window`. The first groups are small, so that the first rows of a layer
    are ready soon. They are well mixed even so, because all rows were permuted when they were written.
    """
    order = random_generator(seed, CHUNKS, pass_index, layer).permutation(chunks)
    groups, start, size = [], 0, 1
    while start < chunks:
        groups.append(order[start : start + size])
        start, size = start + size, min(2 * size, window)
    return groups


def row_order(rows: int, seed: int, pass_index: int, layer: int, group: int) -> np.ndarray:
    """(rows,) a random order of the rows of a group of chunks. rows: number of rows. group: its number."""
    return random_generator(seed, ROWS, pass_index, layer, group).permutation(rows)


def pick_fits(
    count: np.ndarray, visits: int, seed: int, pass_index: int, layer: int, chunk: int
) -> np.ndarray:
    """(R,) which of its fits, numbered from 0, each row of a chunk has in a layer.

    count: (R,) number of fits of each row, at most `visits`. chunk: number of the chunk.
    """
    if np.all(count <= 1):
        return np.zeros(len(count), np.int64)
    # (R, visits) random numbers. Sorting those of a row gives the permutation of its fits in this pass.
    draws = random_generator(seed, FITS, pass_index, chunk).random((len(count), visits))
    place = layer % np.maximum(count, 1)
    picked = np.zeros(len(count), np.int64)
    for fits in np.unique(count[count > 1]):
        rows = np.flatnonzero(count == fits)
        permutations = np.argsort(draws[rows, :fits], axis=1)
        picked[rows] = permutations[np.arange(len(rows)), place[rows]]
    return picked


def first_fits(count: np.ndarray) -> np.ndarray:
    """(R,) the index of each row's first fit if the fits are stored row after row.

    count: (R,) number of fits of each row.
    """
    return np.cumsum(count, dtype=np.int64) - count


def rows_and_fits(
    chunks: Sequence[int],
    rows: Sequence[int],
    count: np.ndarray,
    first: np.ndarray,
    visits: int,
    where: tuple[int, int, int, int],
    part: slice,
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) indices of rows of a group of chunks, in the order of a layer, and (n,) indices of their fits.

    chunks: numbers of the group's chunks. rows: number of rows of each chunk. count, first: (R,) number of
    fits of each row of the group, and index of its first fit (`first_fits`). where: seed, pass, layer and
    group. part: the n places in this order to return.
    """
    seed, pass_index, layer, group = where
    picked = [
        pick_fits(count[end - n : end], visits, seed, pass_index, layer, int(chunk))
        for chunk, n, end in zip(chunks, rows, np.cumsum(rows), strict=True)
    ]
    chosen = row_order(len(count), seed, pass_index, layer, group)[part]
    return chosen, first[chosen] + np.concatenate(picked)[chosen]


# How training processes share the samples of a section: which samples each process reads for each batch.
#
# A section is a part of a pass over the data. Its samples have a fixed order, which is cut into consecutive
# stretches. A batch takes samples from every stretch, about as many from each. With one stretch, a batch is a
# run of consecutive samples. Each process fills certain places of a batch, the same in all batches, and reads
# only the stretches whose samples go to these places. So the content of a batch depends on the number of
# stretches, but not on the number of processes.


@dataclass(frozen=True)
class SampleRange:
    """A stretch: samples `start` to `stop` - 1 of a section, and which of them this process reads.

    share: number of samples that each batch takes from the stretch. low, high: of these samples, numbered
    from 0, this process reads low to high - 1. Other processes read the others.
    """

    start: int
    stop: int
    share: int
    low: int
    high: int

    @property
    def rows(self) -> int:
        """Number of samples of the stretch that this process reads."""
        full, rest = divmod(self.stop - self.start, self.share)
        return full * (self.high - self.low) + max(0, min(rest, self.high) - self.low)

    def own_samples(self, first: int, count: int) -> np.ndarray | slice:
        """Which of `count` consecutive samples this process reads: a mask (count,), or slice(None) for all.

        first: number of the first of these samples in the stretch, from 0.
        """
        if self.high - self.low == self.share:
            return slice(None)
        place = (first + np.arange(count)) % self.share
        return (place >= self.low) & (place < self.high)


@dataclass(frozen=True)
class SectionSharing:
    """A section of `total` samples in batches of `batch` samples, as one process sees it.

    stretches: number of stretches, at most `batch`. own: the places in a batch, from 0, that this process
    fills.
    """

    total: int
    batch: int
    stretches: int
    own: range

    @classmethod
    def for_process(
        cls, total: int, batch: int, stretches: int = 1, rank: int = 0, processes: int = 1
    ) -> SectionSharing:
        """A section as process `rank` (from 0) of `processes` processes sees it.

        The numbers of samples that the processes read of a batch differ by at most one.
        """
        return cls(total, batch, stretches, own_places(batch, rank, processes))

    def batch_sizes(self) -> Iterator[tuple[int, int]]:
        """For each batch: (number of its samples, number of those that this process reads)."""
        for start in range(0, self.total, self.batch):
            size = min(self.batch, self.total - start)
            yield size, max(0, min(size, self.own.stop) - self.own.start)

    def own_stretches(self) -> list[SampleRange]:
        """The stretches that fill this process's places, in the order of the places."""
        full, rest = divmod(self.total, self.batch)  # full batches, and samples of a shorter last batch
        # Stretch s fills places edges[s] to edges[s + 1] - 1 of each batch.
        edges = [self.batch * s // self.stretches for s in range(self.stretches + 1)]
        ranges = []
        for first, end in pairwise(edges):
            low, high = (min(max(place, first), end) - first for place in (self.own.start, self.own.stop))
            if low < high:
                start, stop = (full * edge + min(rest, edge) for edge in (first, end))
                ranges.append(SampleRange(start, stop, end - first, low, high))
        return ranges


def own_places(batch: int, rank: int, processes: int) -> range:
    """The places in a batch that process `rank` of `processes` fills."""
    return range(batch * rank // processes, batch * (rank + 1) // processes)
