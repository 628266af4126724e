"""A feed-forward network with sine and cosine of the phase as extra inputs.

Start reading at `Plain.predict`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from hobble.core.compiled import njit
from hobble.core.quat import Array
from hobble.models.checks import read_weights_and_biases
from hobble.models.network import Export, Network, standardise_inputs
from hobble.models.packing import pack_layer
from hobble.models.stack import Stack, StackPredictor, blend_layers

PHASE_COLUMNS = 2  # inputs after the columns of X: sine and cosine of the phase


@dataclass(frozen=True)
class Plain(Network):
    """A feed-forward network. Its first layer gets X, then sine and cosine of the phase.

    weights: (out, in) float32 for each layer. biases: (out,) float32 for each layer.
    """

    kind: ClassVar[str] = "plain"

    weights: tuple[Array, ...] = field(repr=False)
    biases: tuple[Array, ...] = field(repr=False)

    @classmethod
    def read(cls, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Plain:
        """As in `Model`. arrays: W0 (out, in), b0 (out,), W1, b1, ..."""
        inputs, outputs = len(shared_fields["x_mean"]) + PHASE_COLUMNS, len(shared_fields["y_mean"])
        weights, biases = read_weights_and_biases(path, arrays, ("W", "b"), 2, inputs, outputs)
        return cls(weights=weights, biases=biases, **shared_fields)

    @property
    def sizes(self) -> tuple[int, ...]:
        """Units of each layer, the columns of X first, such as (342, 512, 512, 311)."""
        return (len(self.x_mean), *(len(b) for b in self.biases))

    @property
    def parameter_count(self) -> int:
        """As in `Network`: the number of all weights and biases."""
        without_phase = sum(inputs * outputs + outputs for inputs, outputs in pairwise(self.sizes))
        return without_phase + PHASE_COLUMNS * self.sizes[1]

    @property
    def description(self) -> str:
        """As in `Network`."""
        hidden = len(self.sizes) - 2
        return f"feed-forward network of {hidden} hidden layer{'s' * (hidden != 1)}, given the phase"

    def predict(self, x: Array, phase: Array) -> Array:
        """As in `Network`."""
        h = np.concatenate([standardise_inputs(self, x), phase_columns(phase)], axis=1)
        for number, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            h = h @ weight.T + bias
            if number < len(self.weights) - 1:  # the ELU: h above 0, else e^h - 1
                h = np.where(h > 0, h, np.expm1(np.minimum(h, 0)))
        return h * self.y_std + self.y_mean

    def predictor(self, mode: str | None = None, storage: str | None = None) -> PlainPredictor:
        """As in `Network`; there is one mode."""
        self.resolve_mode(mode)
        return PlainPredictor(self, storage or self.default_storage)

    def page_data(self, inputs: NDArray[np.int64], outputs: NDArray[np.int64]) -> dict[str, Any]:
        """As in `Network`: weights as integers with a factor for each row."""
        weights, biases = list(self.weights), list(self.biases)
        phase_inputs = len(self.x_mean) + np.arange(PHASE_COLUMNS)
        weights[0] = weights[0][:, np.concatenate([inputs, phase_inputs])]
        weights[-1], biases[-1] = weights[-1][outputs], biases[-1][outputs]
        return {"layers": [pack_layer(w[None], b[None]) for w, b in zip(weights, biases, strict=True)]}

    @property
    def exports(self) -> dict[str, Export]:
        """The format "onnx"."""

        def write_onnx(target: Path, mode: str) -> str:
            from hobble.models.plain.onnx_export import write_checked

            difference = write_checked(target, self)
            return f"{target}: differs from Hobble's runtime by at most {difference:.1g}"

        return {"onnx": write_onnx}


class PlainPredictor(StackPredictor):
    """The plain network prepared to run. storage: type of the stored weights, "float32" or "int16"."""

    network: Plain

    def __init__(self, network: Plain, storage: str = "float32") -> None:
        super().__init__(network)
        # A `Stack` blends sets of weights; here is only one set.
        weights, biases = [w[None] for w in network.weights], [b[None] for b in network.biases]
        self._stack = Stack(weights, biases, storage, network.y_mean, network.y_std)

    def evaluate(self, z: Array, phase: Array, out: Array) -> None:
        """As in `Predictor`."""
        stack = self._stack
        _evaluate(stack.weights, stack.numbers, stack.plan, z, phase_columns(phase), out)


@njit(error_model="numpy")
def _evaluate(weights: Any, numbers: Any, plan: Any, z: Any, phase: Any, out: Any) -> None:
    """Write Y (C, Y) into `out`.

    weights, numbers, plan: of a `Stack`. z: (C, X) standardised inputs. phase: (C, PHASE_COLUMNS), the inputs
    after these.
    """
    inputs = np.empty((z.shape[0], z.shape[1] + phase.shape[1]), np.float32)
    for c in range(z.shape[0]):
        for i in range(z.shape[1]):
            inputs[c, i] = z[c, i]
        for i in range(phase.shape[1]):
            inputs[c, z.shape[1] + i] = phase[c, i]
    shares = np.ones((z.shape[0], 1), np.float32)  # of the only set of weights
    blend_layers(weights, numbers, plan, shares, inputs, out)


def phase_columns(phase: Array) -> Array:
    """(n, PHASE_COLUMNS) float32: sine and cosine of phases (n,) in cycles."""
    angle = 2 * np.pi * np.asarray(phase, float)
    return np.stack([np.sin(angle), np.cos(angle)], axis=1).astype(np.float32)
