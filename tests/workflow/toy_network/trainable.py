"""The linear network while it is trained."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import torch

from hobble.models.trainable import Trainable, uniform_start


@dataclass(frozen=True)
class TrainableToy(Trainable):
    kind: ClassVar[str] = "toy"

    inputs: int = 0
    outputs: int = 0

    @property
    def shapes(self):
        return [(self.outputs, 1, self.inputs + 1)]

    def __call__(self, x, p):
        layer = self.layers[0][:, 0]
        return x @ layer[:, :-1].T + layer[:, -1]

    def step(self, dropout, half):
        return Step(self)

    def arrays(self):
        layer = self.layers[0][:, 0].cpu().numpy()
        return {"W0": np.ascontiguousarray(layer[:, :-1]), "b0": np.ascontiguousarray(layer[:, -1])}

    @property
    def file_metadata(self):
        return {"network": "y = W0 x + b0 on standardised x and y"}

    @property
    def description(self):
        return f"{self.inputs}-{self.outputs} linear"


class Step:
    """The gradient is one matrix product. There is no dropout."""

    def __init__(self, network):
        self.network, self.gradients, self.error = network, [], torch.empty(0)
        self.generator, self.input_mask = torch.Generator(), 0

    def __call__(self, x, y, p, masks):
        self.error = self.network(x, p) - y
        with_ones = torch.cat([x, torch.ones(len(x), 1)], dim=1)
        self.gradients = [self.error.T @ with_ones * (2.0 / y.numel())]
        return self.error.square().mean()

    def masks(self, rows, own=slice(None)):
        return []

    def seed(self, seed):
        self.generator.manual_seed(seed)


def fresh(inputs, outputs, seed):
    network = TrainableToy(torch.zeros((inputs + 1) * outputs), inputs, outputs)
    uniform_start(network.layers, np.random.default_rng(seed))
    return network
