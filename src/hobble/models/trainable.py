"""The interface of a network in training: parameters in one buffer, and a step that computes the gradient."""

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

from hobble.models.layer_mirror import LayerMirror
from hobble.rows.mirror_columns import ColumnMirror

ALL_ROWS = slice(None)


class TrainingStep(Protocol):
    """Computes the gradient of the mean squared error on one batch.

    gradients: of the last call, one for each layer, in the order of the layer's parameters. error: (B, Y) of
    the last call, prediction minus y. generator: random numbers for dropout on CUDA. input_mask: index of the
    mask of the network's inputs among `masks`.
    """

    gradients: list[Tensor]
    error: Tensor
    generator: torch.Generator
    input_mask: int

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """Compute `gradients` for x (B, X), y (B, Y), p (B,). Returns the mean squared error, a scalar."""

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """Draw the dropout masks of a batch of `rows` rows, and return those of the rows `own`.

        Processes that share a batch each take their own rows of the same masks.
        """

    def seed(self, seed: int) -> None:
        """Start a new sequence of dropout masks, 0 <= seed < 2^63."""


@dataclass(frozen=True)
class Trainable(ABC):
    """All parameters in one buffer `flat`, layer by layer.

    A layer is (out, K, in + 1): K sets of weights that the network blends, with the bias as the last column.
    So one loop of the optimiser serves all architectures, and a layer is one matrix product with its inputs,
    which are extended by a 1 and multiplied by each of the K shares.
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
    def step(self, dropout: float, half: bool) -> TrainingStep:
        """The fastest step on this device. half: round the factors of the matrix products to bfloat16."""

    @abstractmethod
    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays of its file; `Model.read` builds the network from them."""

    @property
    @abstractmethod
    def about(self) -> dict[str, Any]:
        """Its entries in the file's meta, as JSON. The entry `network` is its formula in one line."""

    @property
    @abstractmethod
    def described(self) -> str:
        """Its shape in a few words. A training resumes only with a network of the same shape."""

    def mirrors(self, inputs: ColumnMirror, outputs: ColumnMirror) -> list[LayerMirror]:
        """How each layer changes with the mirrors of standardised X and Y.

        Raises TypeError for kinds that cannot be trained with `training.symmetric`.
        """
        raise TypeError(f"{type(self).__name__} has no mirror")

    @cached_property
    def layers(self) -> list[Tensor]:
        """(out, K, in + 1) views of `flat`, one for each layer."""
        return self.views(self.flat)

    def views(self, flat: Tensor) -> list[Tensor]:
        """The layers of a buffer laid out like `self.flat`, such as a gradient."""
        parts = flat.split([prod(shape) for shape in self.shapes])
        return [part.view(shape) for part, shape in zip(parts, self.shapes, strict=True)]

    def to(self, device: torch.device | str, dtype: torch.dtype | None = None) -> Self:
        """A copy on another device or in another type."""
        return replace(self, flat=self.flat.to(device, dtype, copy=True))


def uniform_start(layers: Sequence[Tensor], generator: np.random.Generator) -> None:
    """Fill layers: weights within +-sqrt(6 / (in * out)), biases 0 (Holden et al. 2017, as released)."""
    for layer in layers:
        out, k, size = layer.shape
        bound = (6.0 / ((size - 1) * out)) ** 0.5
        layer[:, :, :-1] = torch.from_numpy(generator.uniform(-bound, bound, (out, k, size - 1)))
