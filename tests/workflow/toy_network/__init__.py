"""The smallest possible kind of network, a linear one: y = W x + b, for any phase."""

from hobble.models.model import Trained


class _Toy(Trained):
    def options(self):
        from hobble.models.toy.options import ToyOptions

        return ToyOptions

    def parameters(self, options, inputs, outputs):
        return (inputs + 1) * outputs

    def trainable(self, options, layout, skeleton, seed):
        from hobble.models.toy.trainable import fresh

        return fresh(layout.x_size, layout.y_size, seed)

    def read(self, path, arrays, common):
        from hobble.models.toy.network import Toy

        return Toy.read(path, arrays, common)


MODEL = _Toy()
