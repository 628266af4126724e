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

    gradients: those of the last call, one for each layer, in the order of the layer's parameters. error: (B,
    Y) prediction minus y in the last call. generator: random numbers for dropout on CUDA. input_mask: which
    item of the list of dropout masks is for the network's inputs.
    """

    gradients: list[Tensor]
    error: Tensor
    generator: torch.Generator
    input_mask: int

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """Compute `gradients` for x (B, X), y (B, Y) and phases p (B,). Returns the mean squared error.

        masks: the dropout masks of this batch, from the method `masks`.
        """

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """Draw the dropout masks of a batch of `rows` rows, and return those of the rows `own`.

        Processes that share a batch each take their own rows of the same masks.
        """

    def seed(self, seed: int) -> None:
        """Start a new sequence of dropout masks, 0 <= seed < 2^63."""


@dataclass(frozen=True)
class Trainable(ABC):
    """A network in training. Its parameters are in one buffer `flat`, layer by layer.

    A layer is (out, K, in + 1): K sets of weights, with the bias as the last column. The network blends the
    sets, each with a share. So one loop of the optimiser serves all architectures. A layer is one matrix
    product: its parameters as (out, K (in + 1)), times its inputs, which are extended by a 1 and repeated K
    times, each time multiplied by the share of a set.
    """

    kind: ClassVar[str] = ""  # name of the kind of network, and of its folder in hobble.models

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
        """The fastest step on the device of `flat`.

        dropout: share of units dropped. half: round the factors of the matrix products to bfloat16.
        """

    @abstractmethod
    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays of its file, from which `hobble.models.model.Model.read` builds the network."""

    @property
    @abstractmethod
    def about(self) -> dict[str, Any]:
        """Its entries in the metadata of its file. The entry `network` is its formula in one line."""

    @property
    @abstractmethod
    def described(self) -> str:
        """Its shape in a few words. A training resumes only with a network of the same shape."""

    def mirrors(self, inputs: ColumnMirror, outputs: ColumnMirror) -> list[LayerMirror]:
        """How each layer changes if standardised X and Y are mirrored by `inputs` and `outputs`.

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
    """Fill the weights of layers, uniform within +-sqrt(6 / (in * out)).

    The code that Holden et al. (2017) released starts in the same way. The biases are not changed; in a new
    buffer they are 0.
    """
    for layer in layers:
        out, k, size = layer.shape
        bound = (6.0 / ((size - 1) * out)) ** 0.5
        layer[:, :, :-1] = torch.from_numpy(generator.uniform(-bound, bound, (out, k, size - 1)))
