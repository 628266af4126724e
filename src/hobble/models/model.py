"""The interface of a kind of network: its options, and its network in training.

X are the inputs of a network and Y its outputs. A row is the X and Y of one frame. This module and the kinds'
own `__init__.py` import neither PyTorch nor numba: checking a configuration needs neither, and a game that
runs a network needs no PyTorch.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Protocol, Self

import numpy as np

from hobble.core.section import Section
from hobble.core.skeleton import Skeleton
from hobble.rows.layout import ColumnMirror, RowLayout

if TYPE_CHECKING:
    import torch
    from torch import Tensor

    from hobble.models.network import Network

ALL_ROWS = slice(None)


class Options(Section):
    """The keys of a configuration's `network` section, and what the kind makes of them.

    Each kind has one subclass, a `TrainedOptions` or `BuiltOptions`, named `OPTIONS` in its `__init__.py`.
    """

    modes: ClassVar[tuple[str, ...]] = ("exact",)  # the modes of its networks, see `Network.modes`

    # Whether its rows have columns of local phases, see `hobble.labels.local_phase`.
    uses_local_phases: ClassVar[bool] = False

    kind: str = ""

    @classmethod
    def network_class(cls) -> type[Network]:
        """The class of the kind's networks that are ready to run."""
        raise NotImplementedError

    @property
    def hidden(self) -> tuple[int, ...]:
        """Units of each hidden layer; () for a kind without layers."""
        return ()

    @property
    def why_not_symmetric(self) -> str:
        """Why a network with these options cannot be trained with `training.symmetric`; "" if it can.

        With this key of a configuration, the network treats left and right alike.
        """
        return f"a network of kind {self.kind} cannot treat left and right alike"


class TrainedOptions(Options):
    """Options of a kind that is trained in passes over the shuffled rows of all training clips."""

    def parameter_count(self, inputs: int, outputs: int) -> int:
        """The number of trained parameters, for X of `inputs` columns and Y of `outputs` columns."""
        raise NotImplementedError

    def untrained_network(self, layout: RowLayout, skeleton: Skeleton, seed: int) -> Trainable:
        """A new, untrained network on the CPU. The same seed gives the same network.

        layout: the columns of X and Y, with the joints of `skeleton`.
        """
        raise NotImplementedError


class BuiltOptions(Options):
    """Options of a kind without training. It is built from the training clips' rows, in order of time."""

    def build(self, clips: Sequence[str | Path], layout: RowLayout, skeleton: Skeleton) -> FinishedNetwork:
        """Build a network.

        clips: the files with the clips' rows (`hobble.rows.clip_rows`). layout: the columns of X and Y, which
        may have fewer channels than these files. Raises InputError if a file does not fit the layout.
        """
        raise NotImplementedError


class FinishedNetwork(Protocol):
    """The result of training or building, ready to be written to a file."""

    @property
    @abstractmethod
    def kind(self) -> str:
        """The name of its kind, and of the kind's folder in hobble.models."""

    @abstractmethod
    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays of its file; `Network.read` builds the network from them."""

    @property
    @abstractmethod
    def file_metadata(self) -> dict[str, Any]:
        """Its entries in the file's metadata, as data for JSON. One is `network`, its formula in one line."""

    @property
    @abstractmethod
    def description(self) -> str:
        """Its size in a few words. A training resumes only from a checkpoint with the same words."""


@dataclass(frozen=True)
class BuiltNetwork:
    """A `FinishedNetwork` of a kind that is built. tables: the arrays of its file."""

    kind: str
    tables: dict[str, np.ndarray] = field(repr=False)
    file_metadata: dict[str, Any] = field(repr=False)
    description: str

    def arrays(self) -> dict[str, np.ndarray]:
        """As in `FinishedNetwork`."""
        return self.tables


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


class LayerMirror(NamedTuple):
    """How to mirror a layer (out, K, in + 1) of a network in training.

    inputs: how the layer's inputs change if the motion is mirrored. outputs: the same for its outputs.
    half_cycle: how many of the K sets of weights make half a cycle; 0 if they do not depend on the phase.
    """

    inputs: ColumnMirror
    outputs: ColumnMirror
    half_cycle: int


@dataclass(frozen=True)
class Trainable(FinishedNetwork, ABC):
    """A network in training; a `FinishedNetwork` at any time. Its parameters are in one buffer, layer by
    layer.

    flat: the buffer. The parameters of a layer are (out, K, in + 1): K sets of weights, with the bias as the
    last column. So one loop of the optimiser serves all kinds.
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

    def randomise(self, seed: int) -> Self:
        """Fill the weights with uniform random numbers within +-sqrt(6 / (in * out)); returns the network.

        The code that Holden et al. (2017) released starts in the same way. The biases are not changed; in a
        new buffer they are 0.
        """
        generator = np.random.default_rng([seed, 0])
        for layer in self.layers:
            outputs, sets, inputs = layer.shape[0], layer.shape[1], layer.shape[2] - 1
            bound = (6.0 / (inputs * outputs)) ** 0.5
            layer[:, :, :-1] = layer.new_tensor(generator.uniform(-bound, bound, (outputs, sets, inputs)))
        return self
