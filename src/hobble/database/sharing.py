"""How processes share a section of a pass: which samples each one reads, batch by batch.

The samples of a section have a fixed order, which is cut into consecutive stretches. Each batch takes an
equal share of every stretch. With one stretch, batches are consecutive samples. Each process fills certain
places of a batch, the same in all batches, and reads only the stretches that fill them. So the content of a
batch depends on the number of stretches, but not on the number of processes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np


@dataclass(frozen=True)
class SampleRange:
    """A stretch: samples `start` to `stop` - 1 of a section; each batch gets `share` of them.

    low, high: of the `share` samples of a batch, numbered from 0, this process reads low to high - 1; other
    processes read the rest.
    """

    start: int
    stop: int
    share: int
    low: int
    high: int

    @property
    def rows(self) -> int:
        """How many of its samples this process reads."""
        full, rest = divmod(self.stop - self.start, self.share)
        return full * (self.high - self.low) + max(0, min(rest, self.high) - self.low)

    def kept(self, at: int, count: int) -> np.ndarray | slice:
        """Which samples this process reads, of the `count` samples from number `at` of the stretch on.

        A mask (count,), or slice(None) for all.
        """
        if self.high - self.low == self.share:
            return slice(None)
        place = (at + np.arange(count)) % self.share
        return (place >= self.low) & (place < self.high)


@dataclass(frozen=True)
class PassSharing:
    """A section of `total` samples in batches of `batch`, as one process sees it.

    stretches: number of stretches, at most `batch`. own: the places in a batch, from 0, that it fills.
    """

    total: int
    batch: int
    stretches: int
    own: range

    @classmethod
    def of(cls, total: int, batch: int, stretches: int = 1, rank: int = 0, processes: int = 1) -> PassSharing:
        """The sharing as process `rank` (from 0) of `processes` sees it.

        The processes read equal parts of a batch, to within one sample.
        """
        return cls(total, batch, stretches, own_places(batch, rank, processes))

    def sizes(self) -> Iterator[tuple[int, int]]:
        """For each batch, the number of its samples, and of those that this process reads."""
        for start in range(0, self.total, self.batch):
            whole = min(self.batch, self.total - start)
            yield whole, max(0, min(whole, self.own.stop) - self.own.start)

    def read(self) -> list[SampleRange]:
        """The stretches that fill the process's places, in the order of the places."""
        full, rest = divmod(self.total, self.batch)
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
