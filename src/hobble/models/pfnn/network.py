"""The trained phase-functioned network: reads it from a file, predicts, packs it for the page, exports it."""

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
from hobble.models.network import Export, Network, standardise_inputs
from hobble.models.packing import pack_layer
from hobble.models.pfnn.forward import forward, rounded_to_bins
from hobble.models.pfnn.predictor import MODES, PfnnPredictor

# How many control points a file may have. A cyclic cubic spline needs four.
FEWEST_POINTS, MOST_POINTS = 4, 64


@dataclass(frozen=True)
class Pfnn(Network):
    """Layers whose weights and biases are cyclic cubic splines of the phase, with K control points.

    weights: (K, out, in) float32 for each layer. biases: (K, out) float32 for each layer.
    """

    kind: ClassVar[str] = "pfnn"
    modes: ClassVar[tuple[str, ...]] = tuple(MODES)

    weights: tuple[Array, ...] = field(repr=False)
    biases: tuple[Array, ...] = field(repr=False)

    @classmethod
    def read(cls, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Pfnn:
        """As in `Model`. arrays: W0 (K, out, in), b0 (K, out), W1, b1, ..."""
        inputs, outputs = len(shared_fields["x_mean"]), len(shared_fields["y_mean"])
        weights, biases = read_weights_and_biases(path, arrays, ("W", "b"), 3, inputs, outputs)
        points = len(weights[0])
        if not FEWEST_POINTS <= points <= MOST_POINTS:
            raise InputError(
                path,
                f"{points} control points; from {FEWEST_POINTS} to {MOST_POINTS} are allowed",
            )
        return cls(weights=weights, biases=biases, **shared_fields)

    @property
    def control_points(self) -> int:
        """K, the number of control points."""
        return len(self.weights[0])

    @property
    def sizes(self) -> tuple[int, ...]:
        """Units of each layer, the input first, such as (342, 512, 512, 311)."""
        return (self.weights[0].shape[2], *(w.shape[1] for w in self.weights))

    @property
    def parameter_count(self) -> int:
        """How many weights and biases the layers have at one phase."""
        return sum(inputs * outputs + outputs for inputs, outputs in pairwise(self.sizes))

    def stored_numbers(self, mode: str) -> int:
        """As in `Network`: weights and biases at each of the mode's phases, or of each control point."""
        return (MODES[mode] or self.control_points) * self.parameter_count

    @property
    def description(self) -> str:
        """As in `Network`."""
        hidden = len(self.sizes) - 2
        return (
            f"phase-functioned network of {hidden} hidden layer{'s' * (hidden != 1)} and "
            f"{self.control_points} control points"
        )

    def predict(self, x: Array, phase: Array, constant: bool = False) -> Array:
        """As in `Network`. constant: round phases down to a multiple of 1 / 50, as the mode constant does."""
        z = standardise_inputs(self, x)
        y = forward(self.weights, self.biases, z, rounded_to_bins(phase) if constant else phase)
        return y * self.y_std + self.y_mean

    def predictor(self, mode: str | None = None, storage: str | None = None) -> PfnnPredictor:
        """As in `Network`: mode "constant" (50 phases), "linear" (10, blended) or "cubic" (exact)."""
        return PfnnPredictor(self, mode or "cubic", storage or self.default_storage)

    def page_data(self, inputs: NDArray[np.int64], outputs: NDArray[np.int64]) -> dict[str, Any]:
        """As in `Network`: weights at the control points, as integers with a factor for each row."""
        weights, biases = list(self.weights), list(self.biases)
        weights[0] = weights[0][:, :, inputs]
        weights[-1], biases[-1] = weights[-1][:, outputs], biases[-1][:, outputs]
        return {"layers": [pack_layer(w, b) for w, b in zip(weights, biases, strict=True)]}

    @property
    def exports(self) -> dict[str, Export]:
        """The formats "onnx" and "bin", the .bin files of Holden et al. (2017)."""

        def write_onnx(target: Path, mode: str) -> str:
            from hobble.models.pfnn.onnx_export import write_checked

            difference = write_checked(target, self, mode)
            return f"{target}: differs from Hobble's runtime by at most {difference:.1g}"

        def write_bin(target: Path, mode: str) -> str:
            from hobble.models.pfnn.release import write_release

            write_release(target, self)  # always the weights of the mode constant
            return f"{target}: weights at 50 phases"

        return {"onnx": write_onnx, "bin": write_bin}


def formula(hidden: int) -> str:
    """The formula of a network with `hidden` hidden layers, as one line of text."""
    inside = "x"
    for i in range(hidden):
        inside = f"elu(W{i} {inside} + b{i})"
    return (
        f"y = W{hidden} {inside} + b{hidden} on standardised x and y; W and b are cyclic "
        "Catmull-Rom splines of the phase through their control points at k / control_points"
    )
