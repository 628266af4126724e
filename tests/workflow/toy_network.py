"""The smallest kind of network: feed-forward, without the phase. A test puts it into hobble.models."""

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from hobble.models.blend import BlendedNetwork, BlendedOptions, TrainableBlend


class ToyOptions(BlendedOptions):
    network: ClassVar[str] = "hobble.models.toy:Toy"

    kind: Literal["toy"] = "toy"

    def trainable(self, flat, sizes, columns):
        return TrainableToy(flat, sizes, 1, kind=self.kind)


OPTIONS = ToyOptions


@dataclass(frozen=True)
class Toy(BlendedNetwork):
    """The network at run time: one set of weights, whatever the phase."""

    kind: ClassVar[str] = "toy"
    description: ClassVar[str] = "toy"

    def shares(self, z, phase):
        return np.ones((len(z), 1), np.float32)

    def prepare(self, mode):
        return self.weights, self.biases, self.shares

    def onnx_shares(self, g, z, mode):
        return None, None


@dataclass(frozen=True)
class TrainableToy(TrainableBlend):
    def shares(self, gate, x, p, masks):
        return p.new_ones(len(p), 1)

    def arrays(self):
        return {name: array[0] for name, array in super().arrays().items()}
