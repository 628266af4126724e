"""The trained mode-adaptive network: reading, prediction, data for the report's page, and export.

`hobble.models.mann.forward` explains the experts and the gate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.models.checks import read_weights_and_biases
from hobble.models.mann.forward import forward
from hobble.models.mann.predictor import MannPredictor
from hobble.models.network import Export, Network, standardise_inputs
from hobble.models.packing import pack_layer

MOST_EXPERTS = 64  # largest number of experts in a file


@dataclass(frozen=True)
class Mann(Network):
    """A mode-adaptive network of K experts.

    weights: (K, out, in) float32 for each layer of the experts; biases: (K, out) for each. gate_weights:
    (out, in) for each layer of the gate; gate_biases: (out,) for each. columns: (G,) the columns of X that
    the gate gets.
    """

    kind: ClassVar[str] = "mann"
    uses_phase: ClassVar[bool] = False
    # Reading the weights of all experts takes most of a prediction's time. As int16 they have half the size.
    default_storage: ClassVar[str] = "int16"

    weights: tuple[Array, ...] = field(repr=False)
    biases: tuple[Array, ...] = field(repr=False)
    gate_weights: tuple[Array, ...] = field(repr=False)
    gate_biases: tuple[Array, ...] = field(repr=False)
    columns: NDArray[np.int64] = field(repr=False)

    @classmethod
    def read(cls, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Mann:
        """Check the arrays of a file and build the network.

        W0 (K, out, in), b0 (K, out), ... are the layers of the experts. V0 (out, in), d0 (out,), ... are
        those of the gate. `gate` (G,) holds the columns of X that the gate gets.
        """
        inputs, outputs = len(shared_fields["x_mean"]), len(shared_fields["y_mean"])
        columns = _read_gate_columns(path, arrays, inputs)
        weights, biases = read_weights_and_biases(path, arrays, ("W", "b"), 3, inputs, outputs)
        experts = len(weights[0])
        if not 2 <= experts <= MOST_EXPERTS:
            raise InputError(path, f"has {experts} experts; 2 to {MOST_EXPERTS} are allowed")
        gate_weights, gate_biases = read_weights_and_biases(
            path, arrays, ("V", "d"), 2, len(columns), experts
        )
        return cls(
            weights=weights,
            biases=biases,
            gate_weights=gate_weights,
            gate_biases=gate_biases,
            columns=columns,
            **shared_fields,
        )

    @property
    def experts(self) -> int:
        """K, the number of experts."""
        return len(self.weights[0])

    @property
    def sizes(self) -> tuple[int, ...]:
        """Units of each layer of an expert, the input first, such as (342, 512, 512, 311)."""
        return (self.weights[0].shape[2], *(w.shape[1] for w in self.weights))

    @property
    def parameter_count(self) -> int:
        """The number of all weights and biases, because a prediction may need all experts."""
        gate = sum(w.size + b.size for w, b in zip(self.gate_weights, self.gate_biases, strict=True))
        return gate + self.experts * sum(a * b + b for a, b in pairwise(self.sizes))

    @property
    def description(self) -> str:
        """As in `Network`."""
        hidden = len(self.sizes) - 2
        return (
            f"mode-adaptive network of {hidden} hidden layer{'s' * (hidden != 1)} and {self.experts} experts"
        )

    def predict(self, x: Array, phase: Array) -> Array:
        """As in `Network`; the phase is ignored."""
        z = standardise_inputs(self, x)
        y = forward(self.weights, self.biases, self.gate_weights, self.gate_biases, self.columns, z)
        return y * self.y_std + self.y_mean

    def predictor(self, mode: str | None = None, storage: str | None = None) -> MannPredictor:
        """As in `Network`; there is one mode."""
        self.resolve_mode(mode)
        return MannPredictor(self, storage or self.default_storage)

    def page_data(self, inputs: NDArray[np.int64], outputs: NDArray[np.int64]) -> dict[str, Any]:
        """As in `Network`.

        layers: those of the experts, see `pack_layer`. gateLayers: those of the gate. gate: the columns that
        the gate gets, as positions in `inputs`.
        """
        weights, biases, gate = list(self.weights), list(self.biases), list(self.gate_weights)
        weights[0] = weights[0][:, :, inputs]
        weights[-1], biases[-1] = weights[-1][:, outputs], biases[-1][:, outputs]
        position = {int(column): i for i, column in enumerate(inputs)}
        present = [i for i, column in enumerate(self.columns) if int(column) in position]
        gate[0] = gate[0][:, present]
        return {
            "layers": [pack_layer(w, b) for w, b in zip(weights, biases, strict=True)],
            "gateLayers": [pack_layer(w[None], b[None]) for w, b in zip(gate, self.gate_biases, strict=True)],
            "gate": [position[int(self.columns[i])] for i in present],
        }

    @property
    def exports(self) -> dict[str, Export]:
        """As in `Network`: the only format is "onnx"."""

        def onnx(target: Path, mode: str) -> str:
            from hobble.models.mann.onnx_export import write_checked

            difference = write_checked(target, self)
            return f"{target}: differs from Hobble's runtime by at most {difference:.1g}"

        return {"onnx": onnx}


def _read_gate_columns(path: str | Path, arrays: Mapping[str, Any], inputs: int) -> NDArray[np.int64]:
    """The array `gate`: the columns of X that the gate gets. inputs: number of columns of X."""
    if "gate" not in arrays:
        raise InputError(path, "not a network: no gate")
    array = np.asarray(arrays["gate"])
    if array.ndim != 1 or array.dtype.kind not in "iu" or not array.size:
        raise InputError(path, f"gate has shape {array.shape} and type {array.dtype}, not columns of X")
    if array.min() < 0 or array.max() >= inputs or len(np.unique(array)) != array.size:
        raise InputError(path, f"gate must hold columns of X (0 to {inputs - 1}), each at most once")
    return array.astype(np.int64)
