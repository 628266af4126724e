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
from hobble.rows.layout import ColumnMirror

ALL_ROWS = slice(None)


class TrainingStep(Protocol):
    """Computes the gradient of the mean squared error on one batch.

    gradients: result of the last call, one gradient for each layer, with its numbers in the order of the
    layer's parameters. error: (B, Y) prediction minus y in the last call. generator: random numbers for
    dropout on CUDA. input_mask: index of the mask for the network's inputs in the list that `masks` returns.
    """

    gradients: list[Tensor]
    error: Tensor
    generator: torch.Generator
    input_mask: int

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """Compute `gradients` and `error`, and return the mean squared error.

        x: (B, X). y: (B, Y). p: (B,) phases. masks: the dropout masks of this batch, from the method `masks`.
        """

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """Draw the dropout masks of a batch of `rows` rows, and return the part for the rows `own`.

        If several processes share a batch, each draws the same masks and gets the part for its own rows.
        """

    def seed(self, seed: int) -> None:
        """Start a new sequence of dropout masks, 0 <= seed < 2^63."""


@dataclass(frozen=True)
class Trainable(ABC):
    """A network in training. Its parameters are in one buffer `flat`, layer by layer.

    The parameters of a layer are (out, K, in + 1): K sets of weights, with the bias as the last column. The
    network blends the sets, each with its share. All architectures have this layout, so one loop of the
    optimiser serves them all. A layer is evaluated as one matrix product. One factor is its parameters as
    (out, K (in + 1)). The other is its inputs with a 1 appended, repeated K times and multiplied each time by
    the share of one set.
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
        """Number of columns of X, the network's inputs."""

    @property
    @abstractmethod
    def outputs(self) -> int:
        """Number of columns of Y, the network's outputs."""

    @abstractmethod
    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """Standardised outputs (B, Y) of standardised inputs (B, X) at phases (B,), without dropout."""

    @abstractmethod
    def step(self, dropout: float, half: bool) -> TrainingStep:
        """The training step that is fastest on the device of `flat`.

        dropout: share of the units that are dropped. half: whether to round the factors of the matrix
        products to bfloat16.
        """

    @abstractmethod
    def arrays(self) -> dict[str, np.ndarray]:
        """Name -> array, for the network's file. `hobble.models.model.Model.read` reads them back."""

    @property
    @abstractmethod
    def file_metadata(self) -> dict[str, Any]:
        """The network's entries in the metadata of its file. One is `network`, its formula in one line."""

    @property
    @abstractmethod
    def description(self) -> str:
        """The shape of the network in words, such as its units and the number of its parameters.

        A training resumes from a checkpoint only if the checkpoint has the same words.
        """

    def mirrors(self, inputs: ColumnMirror, outputs: ColumnMirror) -> list[LayerMirror]:
        """How each layer changes if standardised X and Y are mirrored.

        inputs, outputs: how the columns of X and Y are mirrored. Raises TypeError for kinds of networks that
        cannot be trained with `training.symmetric`.
        """
        raise TypeError(f"{type(self).__name__} cannot be mirrored, so set training.symmetric: false")

    @cached_property
    def layers(self) -> list[Tensor]:
        """(out, K, in + 1) views of the parameters, one for each layer."""
        return self.views(self.flat)

    def views(self, flat: Tensor) -> list[Tensor]:
        """(out, K, in + 1) views of `flat`, one for each layer. flat: a buffer laid out like `self.flat`."""
        parts = flat.split([prod(shape) for shape in self.shapes])
        return [part.view(shape) for part, shape in zip(parts, self.shapes, strict=True)]

    def to(self, device: torch.device | str, dtype: torch.dtype | None = None) -> Self:
        """A copy on another device or in another type."""
        return replace(self, flat=self.flat.to(device, dtype, copy=True))


def uniform_start(layers: Sequence[Tensor], generator: np.random.Generator) -> None:
    """Fill the weights of layers (out, K, in + 1) with uniform random numbers within +-sqrt(6 / (in * out)).

    The code that Holden et al. (2017) released starts in the same way. The biases are not changed; in a new
    buffer they are 0.
    """
    for layer in layers:
        outputs, sets, inputs = layer.shape[0], layer.shape[1], layer.shape[2] - 1
        bound = (6.0 / (inputs * outputs)) ** 0.5
        layer[:, :, :-1] = torch.from_numpy(generator.uniform(-bound, bound, (outputs, sets, inputs)))
