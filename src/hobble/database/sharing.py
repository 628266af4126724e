"""How training processes share the samples of a section: which samples each process reads for each batch.

A section is a part of a pass over the data. Its samples have a fixed order, which is cut into consecutive
stretches. A batch takes samples from every stretch, about as many from each. With one stretch, a batch is a
run of consecutive samples. Each process fills certain places of a batch, the same in all batches, and reads
only the stretches whose samples go to these places. So the content of a batch depends on the number of
stretches, but not on the number of processes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np


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
