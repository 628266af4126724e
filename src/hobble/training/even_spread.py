"""Numbers between 0 and 1 for the rows of a batch, the same for any number of processes."""

from __future__ import annotations

import math

import torch
from torch import Tensor

# The number of a row is the fractional part of place * STEP_OF_PLACE + batch * STEP_OF_BATCH, with the row's
# place in the batch and the number of the batch. As the steps are irrational, these fractional parts are
# spread evenly over 0..1.
STEP_OF_PLACE, STEP_OF_BATCH = (math.sqrt(5) - 1) / 2, math.sqrt(2) - 1


class EvenSpread:
    """Gives each row of a batch a number from 0 to 1. The numbers are spread evenly over rows and batches.

    A number depends only on the row's place in the whole batch and on how many batches came before.

    batch: largest number of this process's rows in a batch. first: the place of its first row in the whole
    batch.
    """

    def __init__(self, batch: int, device: torch.device, first: int = 0) -> None:
        places = first + torch.arange(batch, device=device).double()
        self.place_terms = torch.remainder(places * STEP_OF_PLACE, 1.0)

    def numbers(self, rows: int, batches: int) -> Tensor:
        """(rows,) float64 from 0 to 1, for the first `rows` rows of this process.

        batches: number of batches before this one.
        """
        return torch.remainder(self.place_terms[:rows] + batches * STEP_OF_BATCH, 1.0)
