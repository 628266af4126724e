"""The phase-functioned network in training: its parameters, and the spline coefficients that blend them."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from hobble.models.layer_mirror import LayerMirror, layer_mirrors
from hobble.models.pfnn.network import formula
from hobble.models.products import product
from hobble.models.trainable import Trainable, TrainingStep, uniform_start
from hobble.rows.layout import ColumnMirror


@dataclass(frozen=True)
class TrainablePfnn(Trainable):
    """Layers whose weights and biases are cyclic cubic splines of the phase.

    sizes: units of each layer, the input first, such as (342, 512, 512, 311). control_points: K, the number
    of control points of the splines, equally spaced over a cycle.
    """

    kind: ClassVar[str] = "pfnn"

    sizes: tuple[int, ...]
    control_points: int

    @property
    def shapes(self) -> list[tuple[int, int, int]]:
        """As in `Trainable`."""
        return [(out, self.control_points, size + 1) for size, out in pairwise(self.sizes)]

    @property
    def inputs(self) -> int:
        """Columns of X."""
        return self.sizes[0]

    @property
    def outputs(self) -> int:
        """Columns of Y."""
        return self.sizes[-1]

    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """As in `Trainable`."""
        c = coefficients(p, self.control_points)
        for number, layer in enumerate(self.layers):
            if number:
                x = torch.nn.functional.elu(x)
            x = product(expand(x, c), layer.flatten(1))
        return x

    def mirrors(self, inputs: ColumnMirror, outputs: ColumnMirror) -> list[LayerMirror]:
        """As in `Trainable`. Half a cycle is half of the control points."""
        return layer_mirrors(inputs, outputs, self.sizes[1:-1], self.control_points // 2)

    def step(self, dropout: float, half: bool) -> TrainingStep:
        """As in `Trainable`: the step with compiled loops on a CPU, the step in PyTorch elsewhere."""
        from hobble.models.pfnn import fused, step

        on_cpu = self.flat.device.type == "cpu"
        return (fused.FusedPfnnStep if on_cpu else step.PfnnStep)(self, dropout, half)

    def arrays(self) -> dict[str, np.ndarray]:
        """As in `Trainable`: `W0` (K, out, in), `b0` (K, out), `W1`, `b1`, ..."""
        arrays = {}
        for number, layer in enumerate(self.layers):
            values = layer.cpu().numpy()
            arrays[f"W{number}"] = np.ascontiguousarray(values[:, :, :-1].swapaxes(0, 1))
            arrays[f"b{number}"] = np.ascontiguousarray(values[:, :, -1].T)
        return arrays

    @property
    def file_metadata(self) -> dict[str, Any]:
        """As in `Trainable`."""
        return {"control_points": self.control_points, "network": formula(len(self.sizes) - 2)}

    @property
    def description(self) -> str:
        """As in `Trainable`."""
        units, count = "-".join(map(str, self.sizes)), parameter_count(self.sizes, self.control_points)
        return f"{units} units and {self.control_points} control points ({count:,} parameters)"


def parameter_count(sizes: tuple[int, ...], control_points: int) -> int:
    """The number of weights and biases at all control points, which is the length of `Trainable.flat`."""
    return control_points * sum((size + 1) * out for size, out in pairwise(sizes))


def untrained_network(sizes: tuple[int, ...], control_points: int, seed: int) -> TrainablePfnn:
    """A new network. Its weights are random, uniform within +-sqrt(6 / (in * out)), and its biases are 0.

    The code that Holden et al. (2017) released starts in the same way.
    """
    flat = torch.zeros(parameter_count(sizes, control_points))
    network = TrainablePfnn(flat, tuple(sizes), control_points)
    uniform_start(network.layers, np.random.default_rng([seed, 0]))
    return network


def coefficients(p: Tensor, control_points: int) -> Tensor:
    """(B, K) coefficients of the control points at phases (B,), for the cyclic cubic Catmull-Rom spline.

    They sum to 1. At p = k / K only the coefficient of control point k is not 0.
    """
    position = torch.remainder(p, 1.0) * control_points
    before = torch.floor(position)  # the control point at or before the phase
    t = (position - before)[:, None]
    index = before.long()[:, None] + torch.arange(-1, 3, device=p.device)  # of the four points around it
    cubic = torch.cat(
        [
            ((2 - t) * t - 1) * t / 2,
            ((3 * t - 5) * t * t + 2) / 2,
            ((4 - 3 * t) * t + 1) * t / 2,
            (t - 1) * t * t / 2,
        ],
        dim=1,
    )
    points = torch.arange(control_points, device=p.device)
    is_point = torch.remainder(index, control_points)[:, :, None] == points
    return torch.sum(cubic[:, :, None] * is_point, dim=1)


def expand(x: Tensor, c: Tensor) -> Tensor:
    """(B, K (n + 1)): each row of x (B, n) with a 1 appended, times each coefficient of the row, c (B, K)."""
    return torch.cat([c[:, :, None] * x[:, None, :], c[:, :, None]], dim=2).flatten(1)
