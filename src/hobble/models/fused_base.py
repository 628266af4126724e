"""What the fast (fused) training steps on a CPU share: dropout masks, and buffers reused for every batch."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor

from hobble.models.kernels import counter_after, draw, use_threads
from hobble.models.products import product
from hobble.models.trainable import ALL_ROWS


class FusedBase:
    """First base class of a kind's fused step. The second is its plain step, such as `PfnnStep`.

    The plain step sets three fields. network: the network in training. keep: the share of units that dropout
    keeps. widths: the number of inputs of each layer, in the order of the masks.
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
        """Like `masks` of the plain step, with other random numbers. The next call overwrites the masks."""
        first, stop, _ = own.indices(rows)
        masks = []
        for number, width in enumerate(self.widths):
            masks.append(self.buffer(f"mask {number}", stop - first, width))
            use_threads((stop - first) * width)
            draw(masks[-1].numpy(), counter_after(self.counter, first * width), self.keep)
            self.counter = counter_after(self.counter, rows * width)
        return masks

    def multiplied(self, name: str, a: Tensor, b: Tensor) -> Tensor:
        """Like `multiplied` of the plain step. The result is in memory that the next step uses again."""
        return product(a, b, self.buffer(name, len(a), len(b), a.dtype))

    def buffer(self, name: str, rows: int, width: int, dtype: torch.dtype | None = None) -> Tensor:
        """(rows, width) of uninitialised memory. The same name and width give the same memory."""
        key = (name, width)
        if key not in self.buffers or len(self.buffers[key]) < rows:
            self.buffers[key] = torch.empty(rows, width, dtype=dtype or self.network.flat.dtype)
        return self.buffers[key][:rows]
