"""How processes share a section of a pass: which of its samples each one reads, batch by batch.

A section's samples stand in one order, whatever reads them. It is cut into stretches, one after another. Each
batch takes its share of every stretch, so that the samples of a batch come from as many places of the
section as there are stretches. With one stretch, batches are consecutive samples. A process owns some
places of each batch, the same ones in all batches, and reads only the stretches that fill them. So what a
batch holds depends on the number of stretches and never on the number of processes.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np


@dataclass(frozen=True)
class Stretch:
    """Samples `start` to `stop` of a section, of which every `share` go into one batch.

    low, high: which of those `share` are read; the others are for another process.
    """

    start: int
    stop: int
    share: int
    low: int
    high: int

    @property
    def rows(self) -> int:
        """How many samples of it are read."""
        full, rest = divmod(self.stop - self.start, self.share)
        return full * (self.high - self.low) + max(0, min(rest, self.high) - self.low)

    def kept(self, at: int, count: int) -> np.ndarray | slice:
        """Which of `count` samples are read, of which the first is number `at` of the stretch."""
        if self.high - self.low == self.share:
            return slice(None)
        place = (at + np.arange(count)) % self.share
        return (place >= self.low) & (place < self.high)


@dataclass(frozen=True)
class Sharing:
    """A section of `total` samples in batches of `batch`, as one process sees it.

    stretches: at most `batch`. own: the places in a batch, from 0, that this process fills.
    """

    total: int
    batch: int
    stretches: int
    own: range

    @classmethod
    def of(cls, total: int, batch: int, stretches: int = 1, rank: int = 0, processes: int = 1) -> Sharing:
        """That of process `rank`, from 0, of `processes`, whose parts of a batch differ by one at most."""
        return cls(total, batch, stretches, own_places(batch, rank, processes))

    def sizes(self) -> Iterator[tuple[int, int]]:
        """For each batch its samples, and those of them that this process reads; only the last is short."""
        for start in range(0, self.total, self.batch):
            whole = min(self.batch, self.total - start)
            yield whole, max(0, min(whole, self.own.stop) - self.own.start)

    def read(self) -> list[Stretch]:
        """The stretches that fill the process's places, in the order of the places."""
        full, rest = divmod(self.total, self.batch)
        edges = [self.batch * s // self.stretches for s in range(self.stretches + 1)]
        found = []
        for first, end in pairwise(edges):
            low, high = (min(max(place, first), end) - first for place in (self.own.start, self.own.stop))
            if low < high:
                start, stop = (full * edge + min(rest, edge) for edge in (first, end))
                found.append(Stretch(start, stop, end - first, low, high))
        return found


def own_places(batch: int, rank: int, processes: int) -> range:
    """The places in a batch that process `rank` of `processes` fills."""
    return range(batch * rank // processes, batch * (rank + 1) // processes)
