"""The mode-adaptive network (Zhang, Starke, Komura, Saito 2018); `hobble.models.forward` explains it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hobble.core.declared import ArrayOf
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.blend import BlendedNetwork, BlendedOptions, TrainableBlend
from hobble.models.forward import forward, softmax
from hobble.models.load import read_arrays, read_layers
from hobble.models.network import GATED
from hobble.rows.layout import CONTACTS, GAITS, RowLayout

if TYPE_CHECKING:
    from torch import Tensor

    from hobble.models.onnx_file import Graph, Node
    from hobble.models.predict import Shares

GOAL_INPUTS = 2 * len(GAITS) + 2  # number of `goal_columns`
GATE_INPUTS = 3 * len(CONTACTS) + GOAL_INPUTS  # number of the columns that the gate gets


def goal_columns(layout: RowLayout) -> tuple[int, ...]:
    """The columns of X for the gait now and at the end of the trajectory, and the position of this end.

    The position depends on the target velocity.
    """
    samples, now, last = layout.samples, layout.samples // 2, layout.samples - 1
    return (
        *(layout.x_gait.start + gait * samples + at for at in (now, last) for gait in range(len(GAITS))),
        layout.x_position.start + last,
        layout.x_position.start + samples + last,
    )


class MannOptions(BlendedOptions):
    """experts: number of experts, that is, sets of weights. gate_layers: number of hidden layers of the gate.

    gate_units: units of each of these. The defaults are those of Zhang et al. 2018.
    """

    network: ClassVar[str] = "hobble.models.mann:Mann"

    kind: Literal["mann"] = "mann"
    gate_inputs: ClassVar[int] = GATE_INPUTS  # number of `gate_columns`
    experts: Annotated[int, Field(ge=2, le=32)] = 8
    gate_layers: Annotated[int, Field(ge=1, le=4)] = 2
    gate_units: Annotated[int, Field(gt=0, le=1024)] = 32

    def trainable(self, flat: Any, sizes: tuple[int, ...], columns: tuple[int, ...]) -> TrainableMann:
        """As in `BlendedOptions`."""
        gate = (self.gate_inputs, *[self.gate_units] * self.gate_layers, self.experts)
        return TrainableMann(flat, sizes, self.experts, gate, columns, kind=self.kind)

    def gate_columns(self, layout: RowLayout, skeleton: Skeleton) -> tuple[int, ...]:
        """The columns of X that the gate gets: the velocities of heels and toes, and `goal_columns`."""
        feet = [3 * skeleton.role(role) + axis for role in CONTACTS for axis in range(3)]
        return *(layout.x_joint_velocity.start + column for column in feet), *goal_columns(layout)


OPTIONS = MannOptions


@dataclass(frozen=True)
class Mann(BlendedNetwork):
    """A mode-adaptive network of K experts.

    gate_weights: (1, out, in) for each layer of the gate; gate_biases: (1, out) for each. columns: (G,) the
    columns of X that the gate gets.
    """

    kind: ClassVar[str] = "mann"
    description: ClassVar[str] = "mode-adaptive network"
    uses_phase: ClassVar[bool] = False
    # Reading the weights of all experts takes most of a prediction's time. As int16 they have half the size.
    default_storage: ClassVar[str] = "int16"
    set_word: ClassVar[str] = "experts"
    set_range: ClassVar[tuple[int, int]] = (2, 64)

    gate_weights: tuple[Array, ...] = field(repr=False)
    gate_biases: tuple[Array, ...] = field(repr=False)
    columns: NDArray[np.int64] = field(repr=False)

    @classmethod
    def read_more(
        cls, path: str | Path, arrays: Mapping[str, Any], weights: tuple[Array, ...]
    ) -> dict[str, Any]:
        """As in `BlendedNetwork`. V0 (out, in), d0 (out,), ... are the layers of the gate.

        `gate` (G,) holds the columns of X that the gate gets.
        """
        inputs = weights[0].shape[2]
        columns = read_arrays(path, arrays, {"gate": ArrayOf(("G",), "iu", 0, inputs - 1)})[0]["gate"]
        if len(np.unique(columns)) != len(columns):
            raise InputError(path, "gate must hold columns of X, each at most once")
        gate_weights, gate_biases = read_layers(path, arrays, "Vd", len(columns), len(weights[0]))
        return {"gate_weights": gate_weights, "gate_biases": gate_biases, "columns": columns}

    @property
    def parameter_count(self) -> int:
        """The number of all weights and biases, because a prediction may need all experts."""
        layers = (*self.weights, *self.biases, *self.gate_weights, *self.gate_biases)
        return sum(array.size for array in layers)

    def shares(self, z: Array, phase: Array) -> Array:
        """As in `BlendedNetwork`; the phase is ignored."""
        one = np.ones((len(z), 1), np.float32)
        return softmax(forward(self.gate_weights, self.gate_biases, one, z[:, self.columns]))

    def prepare(self, mode: str) -> tuple[tuple[Array, ...], tuple[Array, ...], Shares]:
        """As in `BlendedNetwork`."""
        from hobble.models.predict import Stack, gate_shares

        # The gate stays float32: it is small, and rounding it would change the shares of all experts.
        gate = Stack(self.gate_weights, self.gate_biases)
        return self.weights, self.biases, partial(gate_shares, gate, self.columns, self.sets)

    def engine_data(
        self, mode: str, storage: str, inputs: NDArray[np.int64]
    ) -> tuple[dict[str, int], dict[str, np.ndarray]]:
        """As in `Network`."""
        from hobble.models.predict import Stack

        sizes, sections = super().engine_data(mode, storage, inputs)
        read = np.isin(self.columns, inputs)
        gate = Stack([self.gate_weights[0][:, :, read], *self.gate_weights[1:]], self.gate_biases)
        columns = np.searchsorted(inputs, self.columns[read]).astype(np.int32)
        sizes |= {"form": GATED, "gate_layers": len(self.gate_weights), "gate_inputs": len(columns)}
        return sizes, sections | gate.sections("gate_") | {"gate_columns": columns}

    def onnx_shares(self, g: Graph, z: Node, mode: str) -> tuple[None, Node]:
        """As in `BlendedNetwork`."""
        from hobble.models.onnx_file import add_layers

        h = add_layers(g, self.gate_weights, self.gate_biases, g("Gather", z, self.columns, axis=1))
        return None, g("Softmax", h, axis=1)


@dataclass(frozen=True)
class TrainableMann(TrainableBlend):
    """A mode-adaptive network in training.

    gate: units of each layer of the gate, its inputs first. columns: the columns of X that the gate gets.
    """

    gate: tuple[int, ...]
    columns: tuple[int, ...]

    @property
    def gate_units(self) -> tuple[int, ...]:
        """As in `TrainableBlend`."""
        return self.gate

    def shares(self, gate: list[Tensor], x: Tensor, p: Tensor, masks: list[Tensor] | None) -> Tensor:
        """As in `TrainableBlend`; p is ignored."""
        import torch
        from torch.nn.functional import elu, linear

        h = x[:, list(self.columns)]
        for number, layer in enumerate(gate):
            h = elu(h) if number else h
            h = linear(h * masks[number] if masks else h, layer[:, 0, :-1], layer[:, 0, -1])
        return torch.softmax(h, dim=1)

    def arrays(self) -> dict[str, np.ndarray]:
        """As in `TrainableBlend`. `V0` (out, in), `d0` (out,), ... are the layers of the gate.

        `gate` holds the columns of X that the gate gets.
        """
        arrays = super().arrays()
        for number, layer in enumerate(self.layers[: self.gate_layers]):
            values = layer[:, 0].cpu().numpy()
            arrays[f"V{number}"] = np.ascontiguousarray(values[:, :-1])
            arrays[f"d{number}"] = np.ascontiguousarray(values[:, -1])
        return arrays | {"gate": np.array(self.columns, np.int64)}
