"""Numbers between 0 and 1 for the rows of a batch, the same for any number of processes."""

from __future__ import annotations

import math

import torch
from torch import Tensor

# The fractional parts of the multiples of these irrational numbers are spread evenly over 0..1.
STEP_OF_PLACE, STEP_OF_BATCH = (math.sqrt(5) - 1) / 2, math.sqrt(2) - 1


class EvenSpread:
    """A number for each place of a batch, spread evenly over places and over batches.

    A number depends only on the row's place in the whole batch and on the number of the batch.

    batch: largest number of this process's rows in a batch. first: the place of its first row in the whole
    batch.
    """

    def __init__(self, batch: int, device: torch.device, first: int = 0) -> None:
        places = first + torch.arange(batch, device=device).double()
        self.of_places = torch.remainder(places * STEP_OF_PLACE, 1.0)

    def numbers(self, rows: int, batches: int) -> Tensor:
        """(rows,) float64 between 0 and 1, for the first `rows` rows of the batch with number `batches`."""
        return torch.remainder(self.of_places[:rows] + batches * STEP_OF_BATCH, 1.0)
