"""The held-out error: on clips that are not in training, in all and for each block of Y."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from hobble.database.reader import Database

SPLIT = "held_out"
ROWS_AT_ONCE = 2048  # rows in one product: fast, and within 50 MB


class Predicts(Protocol):
    """A network that predicts standardised outputs: in training, or read from a file."""

    @property
    def outputs(self) -> int:
        """Columns of Y."""

    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """Standardised outputs (B, Y) of standardised inputs (B, X) at phases (B,)."""


class HeldOut:
    """Rows of the held-out clips, each with one of its terrain fits, kept in memory.

    section: samples of a section of the training. After each section a tenth as many rows are measured, 2,000
    to 20,000, which takes a few percent of the training time. `every_row` measures every row, without keeping
    them.
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

    def errors(self, network: Predicts) -> list[float]:
        """Mean squared error of the standardised output on the sample, then that of each block of Y."""
        return self._errors(network, self.sample)

    def every_row(self, network: Predicts) -> list[float]:
        """The same over every held-out row."""
        return self._errors(network, self._stream())

    def _errors(self, network: Predicts, batches: Iterable[tuple[Tensor, ...]]) -> list[float]:
        total = np.zeros(network.outputs)
        rows = 0
        for x, y, p in batches:
            squares = torch.square(network(x, p).sub_(y))
            total += squares.sum(0, dtype=torch.float64).cpu().numpy()
            rows += len(x)
        mean = total / rows if rows else np.full(len(total), np.nan)
        return [float(mean.mean()), *(float(mean[columns].mean()) for columns in self.blocks.values())]

    def _stream(self) -> Iterator[tuple[Tensor, ...]]:
        """Every row once, in random order: the first layer of a pass."""
        visits = self.database.manifest.visits
        for block in self.database.blocks(SPLIT, 0, 0, visits, 0, ROWS_AT_ONCE):
            yield tuple(torch.from_numpy(array).to(self.device) for array in block[:3])
