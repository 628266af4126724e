"""What the fast steps on a CPU have in common: the dropout, and buffers that are kept from batch to batch."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch import Tensor

from hobble.models.kernels import draw, further, team
from hobble.models.trainable import EVERY


class Fused:
    """Stands before a kind's `Step` in the bases of its fused one.

    network, keep, widths: of the `Step`: what is trained, the share of units that dropout keeps, and how many
    inputs each layer has in the order of its masks.
    """

    network: Any
    keep: float
    widths: Any

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.counter = np.uint64(0)
        self.buffers: dict[tuple[str, int], Tensor] = {}

    def seed(self, seed: int) -> None:
        """Begin a new sequence of dropout masks, 0 <= seed < 2^63."""
        self.counter = np.uint64(seed)

    def masks(self, rows: int, own: slice = EVERY) -> list[Tensor]:
        """As in `Step`, from another generator; valid until the next call."""
        first, stop, _ = own.indices(rows)
        masks = []
        for number, width in enumerate(self.widths):
            masks.append(self.buffer(f"mask {number}", stop - first, width))
            team((stop - first) * width)
            draw(masks[-1].numpy(), further(self.counter, first * width), self.keep)
            self.counter = further(self.counter, rows * width)
        return masks

    def buffer(self, name: str, rows: int, width: int, dtype: torch.dtype | None = None) -> Tensor:
        """(rows, width) of uninitialised memory; the same memory whenever the name and the width are."""
        key = (name, width)
        if key not in self.buffers or len(self.buffers[key]) < rows:
            self.buffers[key] = torch.empty(rows, width, dtype=dtype or self.network.flat.dtype)
        return self.buffers[key][:rows]
