"""The smallest possible kind of network, a linear one: y = W x + b, for any phase."""

from typing import Literal

from hobble.models.model import TrainedOptions


class ToyOptions(TrainedOptions):
    """The kind of network is the only option."""

    kind: Literal["toy"] = "toy"

    @classmethod
    def network_class(cls):
        from hobble.models.toy.network import Toy

        return Toy

    def parameter_count(self, inputs, outputs):
        return (inputs + 1) * outputs

    def untrained_network(self, layout, skeleton, seed):
        import torch
        from hobble.models.toy.network import TrainableToy

        flat = torch.zeros(self.parameter_count(layout.x_size, layout.y_size))
        return TrainableToy(flat, layout.x_size, layout.y_size).randomise(seed)


OPTIONS = ToyOptions
