"""The smallest possible kind of network, a linear one: y = W x + b, for any phase."""

from hobble.models.model import TrainedModel


class _Toy(TrainedModel):
    def options_class(self):
        from hobble.models.toy.options import ToyOptions

        return ToyOptions

    def parameter_count(self, options, inputs, outputs):
        return (inputs + 1) * outputs

    def untrained_network(self, options, layout, skeleton, seed):
        from hobble.models.toy.trainable import fresh

        return fresh(layout.x_size, layout.y_size, seed)

    def read(self, path, arrays, shared_fields):
        from hobble.models.toy.network import Toy

        return Toy.read(path, arrays, shared_fields)


MODEL = _Toy()
