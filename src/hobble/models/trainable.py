"""A network while it is trained: parameters in one buffer, and a way to find their gradient."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod
from typing import Any, ClassVar, Protocol, Self

import numpy as np
import torch
from torch import Tensor

EVERY = slice(None)


class Step(Protocol):
    """The gradient of the mean squared error on one batch.

    gradients: of the last call, one for each layer, of as many numbers in the same order. error: of the last
    call, (B, Y), prediction minus y. generator: of the dropout, on CUDA.
    """

    gradients: list[Tensor]
    error: Tensor
    generator: torch.Generator

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """Find `gradients` for x (B, X), y (B, Y), p (B,); the mean squared error, a scalar tensor."""

    def masks(self, rows: int, own: slice = EVERY) -> list[Tensor]:
        """Draw the dropout of a batch of `rows` rows; that of the rows `own`, the others are for others."""

    def seed(self, seed: int) -> None:
        """Begin a new sequence of dropout, 0 <= seed < 2^63."""


@dataclass(frozen=True)
class Trainable(ABC):
    """Every parameter in one buffer `flat`, layer by layer.

    A layer is (out, K, in + 1): K sets of weights, blended in whatever way the network has, the last column
    being the bias. So the optimiser is one sweep and knows no architecture, and a layer is one product with
    inputs expanded by a 1 and by the shares of the K.
    """

    kind: ClassVar[str] = ""  # its folder in hobble.models

    flat: Tensor

    @property
    @abstractmethod
    def shapes(self) -> Sequence[tuple[int, int, int]]:
        """(out, K, in + 1) of each layer in `flat`."""

    @property
    @abstractmethod
    def inputs(self) -> int:
        """Columns of X."""

    @property
    @abstractmethod
    def outputs(self) -> int:
        """Columns of Y."""

    @abstractmethod
    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """Standardised outputs (B, Y) of standardised inputs (B, X) at phases (B,), without dropout."""

    @abstractmethod
    def step(self, dropout: float, half: bool) -> Step:
        """The way to find its gradient on the device it is on, as fast as can be.

        half: round the factors of the products to bfloat16.
        """

    @abstractmethod
    def arrays(self) -> dict[str, np.ndarray]:
        """What a file holds of it, from which its `Model.read` builds the network."""

    @property
    @abstractmethod
    def about(self) -> dict[str, Any]:
        """What a file's meta says of it, as JSON; `network` is what it computes, in a line."""

    @property
    @abstractmethod
    def described(self) -> str:
        """Its shape in a few words: a training goes on only with a network of the same."""

    @cached_property
    def layers(self) -> list[Tensor]:
        """(out, K, in + 1) views of `flat`, one for each layer."""
        return self.views(self.flat)

    def views(self, flat: Tensor) -> list[Tensor]:
        """The layers of a buffer laid out like `self.flat`: of a gradient, of a moment."""
        parts = flat.split([prod(shape) for shape in self.shapes])
        return [part.view(shape) for part, shape in zip(parts, self.shapes, strict=True)]

    def to(self, device: torch.device | str, dtype: torch.dtype | None = None) -> Self:
        """A copy elsewhere, or in another type."""
        return replace(self, flat=self.flat.to(device, dtype, copy=True))


def uniform_start(layers: Sequence[Tensor], generator: np.random.Generator) -> None:
    """Fill layers: weights within +-sqrt(6 / (in * out)), biases 0 (Holden et al. 2017, as released)."""
    for layer in layers:
        out, k, size = layer.shape
        bound = (6.0 / ((size - 1) * out)) ** 0.5
        layer[:, :, :-1] = torch.from_numpy(generator.uniform(-bound, bound, (out, k, size - 1)))
