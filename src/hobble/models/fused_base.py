"""Base of the fused training steps on a CPU: dropout masks, and buffers that are reused for every batch.

A fused step is fast because one compiled loop does the work of several PyTorch operations.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor

from hobble.models.kernels import counter_after, draw_mask, use_threads
from hobble.models.products import product
from hobble.models.trainable import ALL_ROWS


class FusedBase:
    """First base class of the fused training step of a kind of network.

    The second base class is the kind's training step in PyTorch, such as `PfnnStep`. It sets the fields
    network, keep and widths.

    network: the network in training. keep: the share of units that dropout keeps. widths: the number of
    inputs of each layer, in the order of the masks. counter: state of the random number generator for the
    masks. buffers: (name, width) -> memory that the method `buffer` hands out.
    """

    network: Any
    keep: float
    widths: Any

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.counter = np.uint64(0)
        self.buffers: dict[tuple[str, int], Tensor] = {}

    def seed(self, seed: int) -> None:
        """Start a new sequence of dropout masks, 0 <= seed < 2^63."""
        self.counter = np.uint64(seed)

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """Draw the dropout masks of a batch of `rows` rows, and return those of the rows `own`.

        A mask (own rows, width) for each layer: 0 where an input is dropped, else 1 / keep. Processes that
        share a batch each have their own rows; random numbers for the other rows are skipped. The random
        numbers differ from those of the step in PyTorch. The next call overwrites the masks.
        """
        first, stop, _ = own.indices(rows)
        masks = []
        for number, width in enumerate(self.widths):
            masks.append(self.buffer(f"mask {number}", stop - first, width))
            use_threads((stop - first) * width)
            draw_mask(masks[-1].numpy(), counter_after(self.counter, first * width), self.keep)
            self.counter = counter_after(self.counter, rows * width)
        return masks

    def multiply(self, name: str, a: Tensor, b: Tensor) -> Tensor:
        """a @ b.T, in the buffer `name`. The next call with the same name may overwrite the result."""
        return product(a, b, self.buffer(name, len(a), len(b), a.dtype))

    def buffer(self, name: str, rows: int, width: int, dtype: torch.dtype | None = None) -> Tensor:
        """A tensor (rows, width) of uninitialised memory. dtype: by default that of the network's parameters.

        Calls with the same name and width get the same memory, unless a call asks for more rows than before.
        """
        key = (name, width)
        if key not in self.buffers or len(self.buffers[key]) < rows:
            self.buffers[key] = torch.empty(rows, width, dtype=dtype or self.network.flat.dtype)
        return self.buffers[key][:rows]
