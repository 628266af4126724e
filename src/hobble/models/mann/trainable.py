"""The mode-adaptive network in training: the parameters of the experts and the gate.

`hobble.models.mann.forward` explains the network.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import prod
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from hobble.models.products import product
from hobble.models.trainable import Trainable, TrainingStep, uniform_start


@dataclass(frozen=True)
class TrainableMann(Trainable):
    """The parameters of the network: the layers of the gate, then those of the experts.

    A layer of the experts is stored as (K * out, 1, in + 1), expert after expert. So one matrix product gives
    the outputs of all experts, which are then blended.

    sizes: units of each layer of an expert, the input first. gate_sizes: the same for the gate; its last
    number is K, the number of experts. columns: the columns of X that the gate gets.
    """

    kind: ClassVar[str] = "mann"

    sizes: tuple[int, ...]
    gate_sizes: tuple[int, ...]
    columns: tuple[int, ...]

    @property
    def experts(self) -> int:
        """K, the number of experts."""
        return self.gate_sizes[-1]

    @property
    def shapes(self) -> list[tuple[int, int, int]]:
        """As in `Trainable`."""
        return shapes(self.sizes, self.gate_sizes)

    @property
    def inputs(self) -> int:
        """Columns of X."""
        return self.sizes[0]

    @property
    def outputs(self) -> int:
        """Columns of Y."""
        return self.sizes[-1]

    def __call__(self, x: Tensor, p: Tensor) -> Tensor:
        """As in `Trainable`; p is ignored."""
        gate_layers = len(self.gate_sizes) - 1
        h = x[:, list(self.columns)]
        for number, layer in enumerate(self.layers[:gate_layers]):
            h = product(with_one(torch.nn.functional.elu(h) if number else h), layer.flatten(1))
        shares = torch.softmax(h, dim=1)
        for number, layer in enumerate(self.layers[gate_layers:]):
            x = product(with_one(torch.nn.functional.elu(x) if number else x), layer.flatten(1))
            x = torch.bmm(shares[:, None, :], x.view(len(x), self.experts, -1))[:, 0]
        return x

    def step(self, dropout: float, half: bool) -> TrainingStep:
        """As in `Trainable`: compiled loops on a CPU, PyTorch on other devices."""
        from hobble.models.mann import fused, step

        on_cpu = self.flat.device.type == "cpu"
        return (fused.FusedMannStep if on_cpu else step.MannStep)(self, dropout, half)

    def arrays(self) -> dict[str, np.ndarray]:
        """As in `Trainable`.

        `V0` (out, in), `d0` (out,), ... are the layers of the gate. `W0` (K, out, in), `b0` (K, out), ... are
        those of the experts. `gate` holds the columns of X that the gate gets.
        """
        arrays, gate_layers = {}, len(self.gate_sizes) - 1
        for number, layer in enumerate(self.layers):
            values = layer[:, 0].cpu().numpy()
            names = f"V{number}", f"d{number}"
            if number >= gate_layers:
                names = f"W{number - gate_layers}", f"b{number - gate_layers}"
                values = values.reshape(self.experts, -1, values.shape[-1])
            arrays[names[0]] = np.ascontiguousarray(values[..., :-1])
            arrays[names[1]] = np.ascontiguousarray(values[..., -1])
        arrays["gate"] = np.array(self.columns, np.int64)
        return arrays

    @property
    def file_metadata(self) -> dict[str, Any]:
        """As in `Trainable`."""
        # For two layers each: gate is "V1 elu(V0 x[gate] + d0) + d1", inside is "elu(W0 x + b0)".
        gate, inside = "x[gate]", "x"
        for i in range(len(self.gate_sizes) - 1):
            gate = f"V{i} {gate} + d{i}" if i == 0 else f"V{i} elu({gate}) + d{i}"
        for i in range(len(self.sizes) - 2):
            inside = f"elu(W{i} {inside} + b{i})"
        last = len(self.sizes) - 2
        text = f"y = W{last} {inside} + b{last} on standardised x and y; W and b are blended from those of "
        return {"experts": self.experts, "network": f"{text}the experts, in the shares softmax({gate})"}

    @property
    def description(self) -> str:
        """As in `Trainable`."""
        units, gate = ("-".join(map(str, sizes)) for sizes in (self.sizes, self.gate_sizes))
        return (
            f"{units} units, {self.experts} experts and a gate of {gate} ({self.flat.numel():,} parameters)"
        )


def shapes(sizes: tuple[int, ...], gate_sizes: tuple[int, ...]) -> list[tuple[int, int, int]]:
    """(out, 1, in + 1) of each layer of the gate, then (K * out, 1, in + 1) of each layer of the experts."""
    gate = [(out, 1, size + 1) for size, out in pairwise(gate_sizes)]
    return gate + [(gate_sizes[-1] * out, 1, size + 1) for size, out in pairwise(sizes)]


def untrained_network(
    sizes: tuple[int, ...], gate_sizes: tuple[int, ...], columns: tuple[int, ...], seed: int
) -> TrainableMann:
    """A new network. Its weights are random, uniform within +-sqrt(6 / (in * out)), its biases 0.

    The arguments are those of `TrainableMann`, and the seed of the random numbers.
    """
    flat = torch.zeros(sum(map(prod, shapes(sizes, gate_sizes))))
    network = TrainableMann(flat, tuple(sizes), tuple(gate_sizes), tuple(columns))
    gate_layers, generator = len(gate_sizes) - 1, np.random.default_rng([seed, 0])
    uniform_start(network.layers[:gate_layers], generator)
    for layer in network.layers[gate_layers:]:
        # As (out, K, in + 1), so that `out` is the number of outputs of one expert.
        experts = layer.view(network.experts, -1, layer.shape[-1])
        uniform_start([experts.transpose(0, 1)], generator)
    return network


def with_one(x: Tensor) -> Tensor:
    """x (B, n) with a 1 appended to each row, for the bias."""
    return torch.cat([x, torch.ones_like(x[:, :1])], dim=1)
