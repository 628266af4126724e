"""Blended stacks, the networks that `hobble.models.forward` explains: read from a file, and in training.

A kind of them has three subclasses: of `BlendedOptions`, `BlendedNetwork` and `TrainableBlend`. They say
where the shares of the sets of weights come from; what is here is the same for all of them.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.forward import forward
from hobble.models.load import read_layers
from hobble.models.model import LayerMirror, Trainable, TrainedOptions, TrainingStep
from hobble.models.network import FIXED, standardise_inputs
from hobble.models.onnx_file import Graph, Node, OnnxNetwork, add_layers
from hobble.rows.layout import ColumnMirror, RowLayout

if TYPE_CHECKING:
    from torch import Tensor

    from hobble.models.predict import BlendPredictor, Shares


class BlendedOptions(TrainedOptions):
    """hidden_layers: number of hidden layers. units: units of each of them. The defaults are as published."""

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
        """As in `TrainedOptions`."""
        return sum(map(prod, self.trainable(None, (inputs, *self.hidden, outputs), ()).shapes))

    def untrained_network(self, layout: RowLayout, skeleton: Skeleton, seed: int) -> TrainableBlend:
        """As in `TrainedOptions`."""
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

    def predictor(self, mode: str | None = None, storage: str | None = None) -> BlendPredictor:
        """As in `Network`."""
        from hobble.models.predict import BlendPredictor

        prepared = self.prepare(self.resolve_mode(mode))
        return BlendPredictor(self, *prepared, self.extended, storage or self.default_storage)

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

    def layers_in_words(self) -> str:
        """Such as "2 hidden layers"."""
        hidden = len(self.sizes) - 2
        return f"{hidden} hidden layer{'s' * (hidden != 1)}"


@dataclass(frozen=True)
class TrainableBlend(Trainable):
    """A blended stack in training. Its first layers are those of the gate, if it has one.

    units: units of each layer, the columns of X first. sets: K.
    """

    extra_inputs: ClassVar[int] = 0  # as in `BlendedNetwork`

    units: tuple[int, ...]
    sets: int

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
        """As in `Trainable`."""
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
        """As in `Trainable`."""
        from hobble.models.step import evaluate

        return evaluate(self, self.layers, x, p)

    def step(self, dropout: float, half: bool) -> TrainingStep:
        """As in `Trainable`: compiled loops on a CPU, PyTorch's own gradient elsewhere."""
        from hobble.models.step import AutogradStep, FusedStep

        return (FusedStep if self.flat.device.type == "cpu" else AutogradStep)(self, dropout, half)

    def arrays(self) -> dict[str, np.ndarray]:
        """As in `FinishedNetwork`: `W0` (K, out, in), `b0` (K, out), `W1`, `b1`, ..."""
        arrays = {}
        for number, layer in enumerate(self.layers[self.gate_layers :]):
            values = layer.cpu().numpy().swapaxes(0, 1)
            arrays[f"W{number}"] = np.ascontiguousarray(values[:, :, :-1])
            arrays[f"b{number}"] = np.ascontiguousarray(values[:, :, -1])
        return arrays

    def formula(self, x: str = "x") -> str:
        """The formula of the layers as text, without a word on W and b. x: the first layer's inputs."""
        last = len(self.units) - 2
        for i in range(last):
            x = f"elu(W{i} {x} + b{i})"
        return f"y = W{last} {x} + b{last} on standardised x and y; "

    @property
    def units_in_words(self) -> str:
        """Such as "342-512-512-311 units"."""
        return f"{'-'.join(map(str, self.units))} units"

    def mirrors(self, inputs: ColumnMirror, outputs: ColumnMirror) -> list[LayerMirror]:
        """As in `Trainable`."""
        columns = [self.mirror_of_inputs(inputs), *map(_mirror_of_units, self.units[1:-1]), outputs]
        return [LayerMirror(before, after, self.half_cycle) for before, after in pairwise(columns)]

    @property
    def half_cycle(self) -> int:
        """As in `LayerMirror`."""
        return 0

    def mirror_of_inputs(self, inputs: ColumnMirror) -> ColumnMirror:
        """The mirror of the first layer's inputs. inputs: that of the columns of X."""
        return inputs


def _mirror_of_units(count: int) -> ColumnMirror:
    """The mirror of `count` hidden units: the first half of them swaps with the second half.

    If `count` is odd, the last unit stays.
    """
    half = count // 2
    source = np.r_[half : 2 * half, :half, 2 * half : count].astype(int)
    return ColumnMirror(source, np.ones(count), np.zeros(count))
