"""The plain network in training. Its training step is that of the kind `pfnn` with one control point."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from hobble.models.layer_mirror import LayerMirror, layer_mirrors
from hobble.models.pfnn.fused import FusedPfnnStep
from hobble.models.pfnn.step import PfnnStep
from hobble.models.plain.network import PHASE_COLUMNS
from hobble.models.products import product
from hobble.models.trainable import ALL_ROWS, Trainable, TrainingStep, uniform_start
from hobble.rows.layout import ColumnMirror


@dataclass(frozen=True)
class TrainablePlain(Trainable):
    """A plain network in training.

    units: number of units of each layer, the columns of X first. The first layer has PHASE_COLUMNS more
    inputs: sine and cosine of the phase.
    """

    kind: ClassVar[str] = "plain"
    control_points: ClassVar[int] = 1  # one set of weights; `PfnnStep` reads this field

    units: tuple[int, ...]

    @property
    def sizes(self) -> tuple[int, ...]:
        """Number of inputs of each layer, with those for the phase, then the number of outputs."""
        return (self.units[0] + PHASE_COLUMNS, *self.units[1:])

    @property
    def shapes(self) -> list[tuple[int, int, int]]:
        """As in `Trainable`."""
        return layer_shapes(self.units)

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
        x = append_phase(x, p)
        for number, layer in enumerate(self.layers):
            if number:
                x = torch.nn.functional.elu(x)
            x = product(torch.cat([x, torch.ones_like(x[:, :1])], dim=1), layer.flatten(1))
        return x

    def mirrors(self, inputs: ColumnMirror, outputs: ColumnMirror) -> list[LayerMirror]:
        """As in `Trainable`. Half a cycle later, sine and cosine of the phase have the opposite sign."""
        phase_inputs = len(inputs.source) + np.arange(PHASE_COLUMNS)
        extended = ColumnMirror(
            np.append(inputs.source, phase_inputs),
            np.append(inputs.sign, -np.ones(PHASE_COLUMNS)),
            np.append(inputs.shift, np.zeros(PHASE_COLUMNS)),
        )
        return layer_mirrors(extended, outputs, self.units[1:-1], 0)

    def step(self, dropout: float, half: bool) -> TrainingStep:
        """As in `Trainable`: the step with compiled loops on a CPU, the step in PyTorch elsewhere."""
        step: Any = FusedPlainStep if self.flat.device.type == "cpu" else PlainStep
        return step(self, dropout, half)

    def arrays(self) -> dict[str, np.ndarray]:
        """As in `Trainable`: `W0` (out, in), `b0` (out,), `W1`, `b1`, ..."""
        arrays = {}
        for number, layer in enumerate(self.layers):
            values = layer[:, 0].cpu().numpy()
            arrays[f"W{number}"] = np.ascontiguousarray(values[:, :-1])
            arrays[f"b{number}"] = np.ascontiguousarray(values[:, -1])
        return arrays

    @property
    def file_metadata(self) -> dict[str, Any]:
        """As in `Trainable`."""
        hidden, inside = len(self.units) - 2, "(x, sin 2 pi p, cos 2 pi p)"
        for i in range(hidden):
            inside = f"elu(W{i} {inside} + b{i})"
        return {"network": f"y = W{hidden} {inside} + b{hidden} on standardised x and y; p is the phase"}

    @property
    def description(self) -> str:
        """As in `Trainable`."""
        return f"{'-'.join(map(str, self.units))} units, given the phase ({self.flat.numel():,} parameters)"


class _WithPhase:
    """First base class of both training steps: appends sine and cosine of the phase to the inputs."""

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """As in `TrainingStep`."""
        return super().__call__(append_phase(x, p), y, p, masks)  # type: ignore[misc]

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """As in `TrainingStep`, but the phase is never dropped. The kind `pfnn` never drops it either."""
        masks: list[Tensor] = super().masks(rows, own)  # type: ignore[misc]
        masks[0][:, -PHASE_COLUMNS:] = 1
        return masks

    def coefficients(self, p: Tensor) -> Tensor:
        """(B, 1) ones, the coefficients of the only set of weights."""
        return torch.ones_like(p[:, None])


class PlainStep(_WithPhase, PfnnStep):  # type: ignore[misc]
    """The plain network's step in PyTorch, on any device."""


class FusedPlainStep(_WithPhase, FusedPfnnStep):  # type: ignore[misc]
    """The plain network's step in compiled loops on a CPU."""


def append_phase(x: Tensor, p: Tensor) -> Tensor:
    """x (B, X) with sine and cosine of phases (B,) appended."""
    angle = 2 * torch.pi * p[:, None]
    return torch.cat([x, torch.sin(angle), torch.cos(angle)], dim=1)


def layer_shapes(units: tuple[int, ...]) -> list[tuple[int, int, int]]:
    """(out, 1, in + 1) of each layer. units: see `TrainablePlain`."""
    inputs = (units[0] + PHASE_COLUMNS, *units[1:-1])
    return [(out, 1, size + 1) for size, out in zip(inputs, units[1:], strict=True)]


def untrained_network(units: tuple[int, ...], seed: int) -> TrainablePlain:
    """A new network. Its weights are random, uniform within +-sqrt(6 / (in * out)), and its biases are 0."""
    network = TrainablePlain(torch.zeros(sum(map(prod, layer_shapes(units)))), units)
    uniform_start(network.layers, np.random.default_rng([seed, 0]))
    return network
