"""Blended stacks, the networks that `hobble.models.forward` explains: read from a file, and in training.

A kind of them has three subclasses: of `BlendedOptions`, `BlendedNetwork` and `TrainableBlend`. They say
where the shares of the sets of weights come from; what is here is the same for all of them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.forward import forward
from hobble.models.load import read_layers
from hobble.models.model import FinishedNetwork, Options
from hobble.models.network import FIXED, standardise_inputs
from hobble.models.onnx_file import Graph, Node, OnnxNetwork, add_layers
from hobble.rows.layout import ColumnMirror, RowLayout

if TYPE_CHECKING:
    import torch
    from torch import Tensor

    from hobble.models.network import Predictor
    from hobble.models.predict import Shares
    from hobble.models.step import AutogradStep


class BlendedOptions(Options):
    """Options of a kind that is trained in passes over the shuffled rows of all training clips.

    hidden_layers: number of hidden layers. units: units of each of them. The defaults are as published."""

    hidden_layers: Annotated[int, Field(ge=1, le=8)] = 2
    units: Annotated[int, Field(gt=0, le=8192)] = 512

    @property
    def hidden(self) -> tuple[int, ...]:
        """As in `Options`."""
        return (self.units,) * self.hidden_layers

    def trainable(self, flat: Any, sizes: tuple[int, ...], columns: tuple[int, ...]) -> TrainableBlend:
        """The network with the parameters `flat`.

        sizes: units of each layer, the columns of X first. columns: from `gate_columns`.
        """
        raise NotImplementedError

    def gate_columns(self, layout: RowLayout, skeleton: Skeleton) -> tuple[int, ...]:
        """The columns of X from which a gate computes the shares; () for a kind without a gate."""
        return ()

    def parameter_count(self, inputs: int, outputs: int) -> int:
        """The number of trained parameters, for X of `inputs` columns and Y of `outputs` columns."""
        return sum(map(prod, self.trainable(None, (inputs, *self.hidden, outputs), ()).shapes))

    def untrained_network(self, layout: RowLayout, skeleton: Skeleton, seed: int) -> TrainableBlend:
        """A new, untrained network on the CPU. The same seed gives the same network.

        layout: the columns of X and Y, with the joints of `skeleton`.
        """
        import torch

        sizes = (layout.x_size, *self.hidden, layout.y_size)
        flat = torch.zeros(self.parameter_count(layout.x_size, layout.y_size))
        return self.trainable(flat, sizes, self.gate_columns(layout, skeleton)).randomise(seed)


@dataclass(frozen=True)
class BlendedNetwork(OnnxNetwork):
    """A blended stack, read from a file.

    weights: (K, out, in) float32 for each layer. biases: (K, out) float32 for each layer.
    """

    set_word: ClassVar[str] = ""  # what a message calls a set of weights
    set_range: ClassVar[tuple[int, int]] = (1, 1)  # fewest and most sets that a file may have
    extra_inputs: ClassVar[int] = 0  # how many inputs follow the columns of X in the first layer

    weights: tuple[Array, ...] = field(repr=False)
    biases: tuple[Array, ...] = field(repr=False)

    @abstractmethod
    def shares(self, z: Array, phase: Array) -> Array:
        """(n, K) float32: the share of each set, for standardised inputs z (n, X) at phases (n,)."""

    @abstractmethod
    def prepare(self, mode: str) -> tuple[tuple[Array, ...], tuple[Array, ...], Shares]:
        """Weights, biases, and a fast function that finds their shares, to run in `mode`, one of `modes`."""

    @abstractmethod
    def onnx_shares(self, g: Graph, z: Node, mode: str) -> tuple[Node | None, Node | None]:
        """Add the nodes that find the shares to an ONNX graph. z: the standardised inputs.

        Returns numbers of sets (batch, n) and their shares (batch, n). Without numbers, the shares are of all
        sets. Without shares, there is one set.
        """

    def extended(self, z: Array, phase: Array) -> Array:
        """The inputs of the first layer, (n, X + extra_inputs), for inputs z (n, X) at phases (n,)."""
        return z

    def onnx_extended(self, g: Graph, z: Node) -> Node:
        """`extended` in an ONNX graph."""
        return z

    def onnx_outputs(self, g: Graph, z: Node, mode: str) -> Node:
        """As in `OnnxNetwork`."""
        weights, biases, _ = self.prepare(mode)
        index, share = self.onnx_shares(g, z, mode)
        return add_layers(g, weights, biases, self.onnx_extended(g, z), share, index)

    @classmethod
    def read(cls, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Self:
        """As in `Network`. arrays: W0 (K, out, in), b0 (K, out), W1, b1, ..."""
        inputs, outputs = len(shared_fields["x_mean"]) + cls.extra_inputs, len(shared_fields["y_mean"])
        weights, biases = read_layers(path, arrays, "Wb", inputs, outputs, cls.set_word, cls.set_range)
        return cls(weights=weights, biases=biases, **cls.read_more(path, arrays, weights), **shared_fields)

    @classmethod
    def read_more(
        cls, path: str | Path, arrays: Mapping[str, Any], weights: tuple[Array, ...]
    ) -> dict[str, Any]:
        """The fields of the kind's class that are read from further arrays of the file."""
        return {}

    @property
    def sizes(self) -> tuple[int, ...]:
        """Units of each layer, the columns of X first, such as (342, 512, 512, 311)."""
        return (len(self.x_mean), *(b.shape[1] for b in self.biases))

    @property
    def sets(self) -> int:
        """K, the number of sets of weights."""
        return len(self.weights[0])

    @property
    def parameter_count(self) -> int:
        """How many weights and biases one blended set has."""
        return sum(w[0].size + b[0].size for w, b in zip(self.weights, self.biases, strict=True))

    def predict(self, x: Array, phase: Array) -> Array:
        """As in `Network`."""
        z = standardise_inputs(self, x)
        y = forward(self.weights, self.biases, self.shares(z, phase), self.extended(z, phase))
        return y * self.y_std + self.y_mean

    def prepared(self, mode: str, storage: str) -> Predictor:
        """As in `Network`."""
        from hobble.models.predict import BlendPredictor

        return BlendPredictor(self, mode, storage)

    def engine_data(
        self, mode: str, storage: str, inputs: NDArray[np.int64]
    ) -> tuple[dict[str, int], dict[str, np.ndarray]]:
        """As in `Network`."""
        from hobble.models.predict import Stack

        weights, biases, _ = self.prepare(mode)
        first = weights[0][:, :, np.r_[inputs, len(self.x_mean) : weights[0].shape[2]]]
        stack = Stack([first, *weights[1:]], biases, storage, self.y_mean, self.y_std)
        sizes = {"form": FIXED, "layers": len(weights), "sets": len(first), "extra": self.extra_inputs}
        return sizes, stack.sections()


class LayerMirror(NamedTuple):
    """How to mirror a layer (out, K, in + 1) of a network in training.

    inputs: how the layer's inputs change if the motion is mirrored. outputs: the same for its outputs.
    half_cycle: how many of the K sets of weights make half a cycle; 0 if they do not depend on the phase.
    """

    inputs: ColumnMirror
    outputs: ColumnMirror
    half_cycle: int


@dataclass(frozen=True)
class TrainableBlend(ABC):
    """A blended stack in training. Its parameters are in one buffer, layer by layer.

    flat: the buffer. The parameters of a layer are (out, K, in + 1): K sets of weights, with the bias as the
    last column. So one loop of the optimiser serves all kinds. The first layers are those of the gate, if
    there is one. units: units of each layer, the columns of X first. sets: K. kind: as in `FinishedNetwork`.
    """

    extra_inputs: ClassVar[int] = 0  # as in `BlendedNetwork`

    flat: Tensor
    units: tuple[int, ...]
    sets: int
    kind: str = field(default="", kw_only=True)

    @abstractmethod
    def shares(self, gate: list[Tensor], x: Tensor, p: Tensor, masks: list[Tensor] | None) -> Tensor:
        """(B, K): the share of each set, for x (B, X) at phases p (B,).

        gate: the layers of the gate. masks: their dropout masks, None without dropout. If there is a gate,
        PyTorch has to be able to differentiate the shares.
        """

    def extended(self, x: Tensor, p: Tensor) -> Tensor:
        """The inputs of the first layer, (B, X + extra inputs), for x (B, X) at phases p (B,)."""
        return x

    @property
    def gate_units(self) -> tuple[int, ...]:
        """Units of each layer of the gate, its inputs first; () without a gate."""
        return ()

    @property
    def shapes(self) -> list[tuple[int, int, int]]:
        """(out, K, in + 1) of each layer in `flat`."""
        gate = [(out, 1, size + 1) for size, out in pairwise(self.gate_units)]
        sizes = (self.units[0] + self.extra_inputs, *self.units[1:])
        return gate + [(out, self.sets, size + 1) for size, out in pairwise(sizes)]

    @property
    def gate_layers(self) -> int:
        """The number of layers of the gate. They come first in `layers`."""
        return max(len(self.gate_units) - 1, 0)

    @property
    def inputs(self) -> int:
        """Columns of X."""
        return self.units[0]

    @property
    def outputs(self) -> int:
        """Columns of Y."""
        return self.units[-1]

    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """Standardised outputs (B, Y) of standardised inputs (B, X) at phases (B,), without dropout."""
        from hobble.models.step import evaluate

        return evaluate(self, self.layers, x, p)

    def step(self, dropout: float, half: bool) -> AutogradStep:
        """The training step: compiled loops on a CPU, PyTorch's own gradient elsewhere.

        dropout: share of the units that are dropped. half: whether to round the factors of the matrix
        products to bfloat16.
        """
        from hobble.models.step import AutogradStep, FusedStep

        return (FusedStep if self.flat.device.type == "cpu" else AutogradStep)(self, dropout, half)

    def arrays(self) -> dict[str, np.ndarray]:
        """The arrays of the network's file: `W0` (K, out, in), `b0` (K, out), `W1`, `b1`, ..."""
        arrays = {}
        for number, layer in enumerate(self.layers[self.gate_layers :]):
            values = layer.cpu().numpy().swapaxes(0, 1)
            arrays[f"W{number}"] = np.ascontiguousarray(values[:, :, :-1])
            arrays[f"b{number}"] = np.ascontiguousarray(values[:, :, -1])
        return arrays

    @property
    def description(self) -> str:
        """As in `FinishedNetwork`."""
        layers = f"{'-'.join(map(str, self.units))} units"
        gate = f" and a gate of {'-'.join(map(str, self.gate_units))}" if self.gate_units else ""
        return f"{layers}, {self.sets} sets of weights{gate} ({self.flat.numel():,} parameters)"

    def finished(self) -> FinishedNetwork:
        """The network with its present parameters, to be written to a file."""
        return FinishedNetwork(self.kind, self.arrays(), self.description)

    def mirrors(self, inputs: ColumnMirror, outputs: ColumnMirror) -> list[LayerMirror]:
        """How each layer changes if standardised X and Y are mirrored.

        inputs, outputs: how the columns of X and Y are mirrored. Raises TypeError for a network with a gate,
        which would have to be mirrored, too.
        """
        if self.gate_units:
            raise TypeError(f"{type(self).__name__} cannot be mirrored, so set training.symmetric: false")
        columns = [self.mirror_of_inputs(inputs), *map(_mirror_of_units, self.units[1:-1]), outputs]
        return [LayerMirror(before, after, self.sets // 2) for before, after in pairwise(columns)]

    def mirror_of_inputs(self, inputs: ColumnMirror) -> ColumnMirror:
        """The mirror of the first layer's inputs. inputs: that of the columns of X."""
        return inputs

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


def _mirror_of_units(count: int) -> ColumnMirror:
    """The mirror of `count` hidden units: the first half of them swaps with the second half.

    If `count` is odd, the last unit stays.
    """
    half = count // 2
    source = np.r_[half : 2 * half, :half, 2 * half : count].astype(int)
    return ColumnMirror(source, np.ones(count), np.zeros(count))
