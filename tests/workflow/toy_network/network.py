"""The linear network at run time, and in training."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hobble.core.declared import ArrayOf
from hobble.models.load import read_arrays
from hobble.models.model import Trainable
from hobble.models.network import FIXED, Network, inverse_or_0, standardise_inputs
from hobble.models.predict import Stack


@dataclass(frozen=True)
class Toy(Network):
    kind: ClassVar[str] = "toy"
    uses_phase: ClassVar[bool] = False

    weights: np.ndarray
    biases: np.ndarray

    @classmethod
    def read(cls, path, arrays, shared_fields):
        outputs, inputs = len(shared_fields["y_mean"]), len(shared_fields["x_mean"])
        declared = {"W0": ArrayOf((outputs, inputs)), "b0": ArrayOf((outputs,))}
        found, _ = read_arrays(path, arrays, declared)
        return cls(weights=found["W0"], biases=found["b0"], **shared_fields)

    @property
    def sizes(self):
        return self.weights.shape[::-1]

    @property
    def parameter_count(self):
        return self.weights.size + self.biases.size

    @property
    def description(self):
        return "toy that is linear"

    def predict(self, x, phase):
        return (standardise_inputs(self, x) @ self.weights.T + self.biases) * self.y_std + self.y_mean

    def predictor(self, mode=None, storage=None):
        self.resolve_mode(mode)
        return Predictor(self)

    def engine_data(self, mode, storage, inputs):
        stack = Stack([self.weights[None, :, inputs]], [self.biases[None]], storage, self.y_mean, self.y_std)
        return {"form": FIXED, "layers": 1, "sets": 1}, stack.sections()


class Predictor:
    def __init__(self, network):
        self.network = network

    def standardise(self, x, z):
        z[:] = (x - self.network.x_mean) * inverse_or_0(self.network.x_std)

    def evaluate(self, z, phase, out):
        n = self.network
        out[:] = (z @ n.weights.T + n.biases) * n.y_std + n.y_mean

    def predict(self, x, phase, out=None):
        z = np.empty_like(x)
        self.standardise(x, z)
        out = np.empty((len(x), len(self.network.y_mean)), np.float32) if out is None else out
        self.evaluate(z, phase, out)
        return out


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
        import torch  # not needed to run the network

        self.network, self.gradients, self.error = network, [], torch.empty(0)
        self.generator, self.input_mask = torch.Generator(), 0

    def __call__(self, x, y, p, masks):
        import torch

        self.error = self.network(x, p) - y
        with_ones = torch.cat([x, torch.ones(len(x), 1)], dim=1)
        self.gradients = [self.error.T @ with_ones * (2.0 / y.numel())]
        return self.error.square().mean()

    def masks(self, rows, own=slice(None)):
        return []

    def seed(self, seed):
        self.generator.manual_seed(seed)
