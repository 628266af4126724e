"""The error on clips that the network never trains on, and on which block of Y it lies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from hobble.database.reader import Database

SPLIT = "held_out"
AT_ONCE = 2048  # rows in one product: large enough to be fast, small enough to stay in 50 MB


class Asked(Protocol):
    """What is asked for predictions: a network in training, or one that is read."""

    @property
    def outputs(self) -> int:
        """Columns of Y."""

    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """Standardised outputs (B, Y) of standardised inputs (B, X) at phases (B,)."""


class HeldOut:
    """Rows of the held-out clips, each with one of its terrain fits, kept in memory.

    section: samples of a section of the training; a tenth of that is measured after each, 2,000 to 20,000
    rows, so that measuring costs a few hundredths of the training. `whole` measures every row, as it streams
    by.
    """

    def __init__(self, database: Database, device: torch.device, section: int) -> None:
        self.database, self.device = database, device
        self.blocks = database.layout.blocks("y")
        rows = min(20_000, max(2_000, section // 10))
        self.sample: list[tuple[Tensor, ...]] = []
        for batch in self._stream():
            self.sample.append(tuple(part[:rows] for part in batch))
            rows -= len(batch[0])
            if rows <= 0:
                break

    def errors(self, network: Asked) -> list[float]:
        """Mean squared error of the standardised output on the sample, then that of each block of Y."""
        return self._errors(network, self.sample)

    def whole(self, network: Asked) -> list[float]:
        """The same over every held-out row."""
        return self._errors(network, self._stream())

    def _errors(self, network: Asked, batches: Iterable[tuple[Tensor, ...]]) -> list[float]:
        total = np.zeros(network.outputs)
        rows = 0
        for x, y, p in batches:
            squares = torch.square(network(x, p).sub_(y))
            total += squares.sum(0, dtype=torch.float64).cpu().numpy()
            rows += len(x)
        mean = total / rows if rows else np.full(len(total), np.nan)
        return [float(mean.mean()), *(float(mean[columns].mean()) for columns in self.blocks.values())]

    def _stream(self) -> Iterator[tuple[Tensor, ...]]:
        """Every row once, in random order: the part of a pass in which each row comes for the first time."""
        visits = self.database.manifest.visits
        for block in self.database.blocks(SPLIT, 0, 0, visits, 0, AT_ONCE):
            yield tuple(torch.from_numpy(array).to(self.device) for array in block[:3])
