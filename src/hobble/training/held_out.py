"""The error on held-out clips, which are not trained on: over all outputs, and for each block of Y."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol

import numpy as np
import torch
from torch import Tensor

from hobble.database.reader import Database

SPLIT = "held_out"
ROWS_AT_ONCE = 2048  # rows predicted at once: enough to be fast, in less than 50 MB


class PredictsStandardised(Protocol):
    """A network that predicts standardised outputs, either in training or read from a file."""

    @property
    def outputs(self) -> int:
        """Number of columns of Y."""

    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """Standardised outputs (B, Y) of standardised inputs (B, X) at phases (B,)."""


class HeldOutErrors:
    """Measures a network on a sample of the held-out clips' rows, each with one of its terrain fits.

    section_samples: number of training samples in a section. The held-out sample has a tenth as many rows,
    but at least 2,000 and at most 20,000, so measuring it after each section takes a few percent of the
    training time. The sample is kept in memory. `errors_on_every_row` measures all rows without keeping them.
    """

    def __init__(self, database: Database, device: torch.device, section_samples: int) -> None:
        self.database, self.device = database, device
        self.blocks = database.layout.blocks("y")
        rows = min(20_000, max(2_000, section_samples // 10))
        self.sample: list[tuple[Tensor, ...]] = []
        for batch in self._batches():
            self.sample.append(tuple(part[:rows] for part in batch))
            rows -= len(batch[0])
            if rows <= 0:
                break

    def errors(self, network: PredictsStandardised) -> list[float]:
        """On the sample, the mean squared error of the whole standardised output, then of each block of Y.

        The blocks have the order of `RowLayout.blocks("y")`. Without held-out rows, all errors are nan.
        """
        return self._errors(network, self.sample)

    def errors_on_every_row(self, network: PredictsStandardised) -> list[float]:
        """The same errors as `errors`, on every held-out row."""
        return self._errors(network, self._batches())

    def _errors(self, network: PredictsStandardised, batches: Iterable[tuple[Tensor, ...]]) -> list[float]:
        total = np.zeros(network.outputs)
        rows = 0
        for x, y, p in batches:
            squares = torch.square(network(x, p).sub_(y))
            total += squares.sum(0, dtype=torch.float64).cpu().numpy()
            rows += len(x)
        mean = total / rows if rows else np.full(len(total), np.nan)
        # The database multiplies the change of phase by phase_weight. This is undone here, so that networks
        # that were trained with different phase weights can be compared.
        mean[self.blocks["phase_change"]] /= self.database.phase_weight**2
        return [float(mean.mean()), *(float(mean[columns].mean()) for columns in self.blocks.values())]

    def _batches(self) -> Iterator[tuple[Tensor, ...]]:
        """Yield every row once, with one of its terrain fits and in random order, as batches (x, y, p).

        A pass uses every row `visits` times. So if it is cut into `visits` sections, its first section has
        every row once.
        """
        visits = self.database.manifest.visits
        for block in self.database.blocks(SPLIT, 0, 0, visits, 0, ROWS_AT_ONCE):
            yield tuple(torch.from_numpy(array).to(self.device) for array in block[:3])
