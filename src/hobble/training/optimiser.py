"""Updates the weights: Adam, the update of one or several processes, and symmetric networks."""

from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor

from hobble.core.compiled import njit
from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.models.blend import LayerMirror, TrainableBlend
from hobble.models.step import ALL_ROWS, AutogradStep, use_threads
from hobble.rows.layout import mirror_of_x, mirror_of_y
from hobble.training.processes import ALONE, Processes

EPSILON = 1e-8  # added to the root of the second moment, so that nothing is divided by 0


def l1_slopes(network: TrainableBlend, l1: float) -> list[float]:
    """For each layer, the factor of sign(w) that the L1 term adds to the gradient of a weight w.

    The term is l1 * (sum over the layers of mean|W|) / (2 * number of layers). The factor 2 is there because
    Holden et al. (2017) divide by the number of parameter arrays: three of weights and three of biases. l1:
    the option `training.l1`.
    """
    layers = network.layers
    return [l1 / (2 * len(layers)) / layer[:, :, :-1].numel() for layer in layers]


class Adam:
    """Adam (Kingma and Ba 2015) on all parameters of a network, which are in one buffer, `network.flat`.

    first_moment, second_moment: running means of the gradient and of its square, laid out like
    `network.flat`. steps: number of steps so far.
    """

    def __init__(
        self, network: TrainableBlend, learning_rate: float, beta1: float, beta2: float, l1: float
    ) -> None:
        self.network = network
        self.learning_rate, self.beta1, self.beta2 = learning_rate, beta1, beta2
        self.slopes = l1_slopes(network, l1)
        self.steps = 0
        self.first_moment = torch.zeros_like(network.flat)
        self.second_moment = torch.zeros_like(network.flat)

    def step(self, gradients: list[Tensor], share: float = 1.0) -> None:
        """Take one step against `gradients`.

        gradients: for each layer (out, K * (in + 1)), where K is the number of sets of weights that the
        network blends. They are without the L1 term, which is added here. share: factor of the learning rate.
        """
        self.steps += 1
        rate = share * self.learning_rate / (1 - self.beta1**self.steps)  # with the first moment's correction
        root = 1 / (1 - self.beta2**self.steps) ** 0.5  # the correction of the root of the second moment
        update = _adam_on_cpu if self.network.flat.device.type == "cpu" else _adam_with_torch
        views = [self.network.layers, *map(self.network.views, (self.first_moment, self.second_moment))]
        for w, m, v, gradient, slope in zip(*views, gradients, self.slopes, strict=True):
            update(w, m, v, gradient.view(w.shape), (self.beta1, self.beta2, rate, root, slope, EPSILON))


Numbers = tuple[float, float, float, float, float, float]  # beta1, beta2, rate, root, slope, EPSILON


def _adam_with_torch(w: Tensor, m: Tensor, v: Tensor, gradient: Tensor, numbers: Numbers) -> None:
    """One step of Adam on a layer, on any device: parameters w, moments m and v."""
    beta1, beta2, rate, root, slope, epsilon = numbers
    g = gradient.to(w.dtype, copy=True)
    g[:, :, :-1].add_(torch.sign(w[:, :, :-1]), alpha=slope)
    m.lerp_(g, 1 - beta1)
    v.mul_(beta2).addcmul_(g, g, value=1 - beta2)
    w.addcdiv_(m * -rate, v.sqrt().mul_(root).add_(epsilon))


def _adam_on_cpu(w: Tensor, m: Tensor, v: Tensor, gradient: Tensor, numbers: Numbers) -> None:
    """The same on a CPU. One loop goes through memory once, because memory limits the speed."""
    arrays = [tensor.flatten(0, 1).numpy() for tensor in (w, m, v, gradient)]
    use_threads(w.numel())
    _adam_loop(*arrays, *(arrays[0].dtype.type(number) for number in numbers))


@njit(parallel=True, error_model="numpy")
def _adam_loop(
    w: Any, m: Any, v: Any, g: Any, b1: Any, b2: Any, rate: Any, root: Any, slope: Any, epsilon: Any
) -> None:
    """One step of Adam on a layer: parameters w, moments m and v, and gradient g, all (rows, in + 1).

    b1, b2: beta1 and beta2. rate, root: see `Adam.step`. slope: see `l1_slopes`.
    """
    one, zero = w.dtype.type(1), w.dtype.type(0)
    last = w.shape[1] - 1
    for row in numba.prange(w.shape[0]):
        for i in range(w.shape[1]):
            d = g[row, i]
            if i < last:  # the last column holds the biases
                d += slope * (one if w[row, i] > zero else (-one if w[row, i] < zero else zero))
            m[row, i] = b1 * m[row, i] + (one - b1) * d
            v[row, i] = b2 * v[row, i] + (one - b2) * d * d
            w[row, i] -= rate * m[row, i] / (root * np.sqrt(v[row, i]) + epsilon)


class Update:
    """Updates the weights with one batch: draws dropout masks, computes the gradient and takes a step.

    If several processes train together, each has its own rows of a batch, maybe none. The loss is a mean over
    the rows of the batch. So each process multiplies its gradient and loss by its share of the rows. Then the
    sums over the processes are the gradient and the loss of the whole batch.

    batch: rows of a whole batch. undropped: columns of X that dropout never drops, such as channels. A
    dropped input gets its mean value. So if channels were dropped, a hurt body would seem less hurt, and the
    network would rely less on its channels.
    """

    def __init__(
        self,
        step: AutogradStep,
        adam: Adam,
        batch: int = 0,
        processes: Processes = ALONE,
        undropped: Tensor | None = None,
    ) -> None:
        self.step, self.adam, self.processes, self.undropped = step, adam, processes, undropped
        self.own = processes.own_places(batch)
        if not processes.is_alone:
            # One buffer for the gradient and, in its last item, the loss, so that one message sends both.
            self.sent = adam.network.flat.new_empty(len(adam.network.flat) + 1)
            self.gradients = adam.network.views(self.sent[:-1])

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, share: float, total: int | None = None) -> Tensor:
        """Train on x (B, X), y (B, Y) and phases p (B,). Returns the loss, a scalar tensor.

        share: factor of the learning rate. total: rows of the batch over all processes, if there are several.
        """
        if self.processes.is_alone:
            loss = self.step(x, y, p, self._masks(len(x), ALL_ROWS))
            self.adam.step(self.step.gradients, share)
            return loss
        total = total or len(p)
        masks = self._masks(total, slice(self.own.start, self.own.stop))
        if len(p):
            loss = self.step(x, y, p, masks)
            for to_send, gradient in zip(self.gradients, self.step.gradients, strict=True):
                to_send.copy_(gradient.view(to_send.shape))
            self.sent[-1] = loss
            self.sent.mul_(len(p) / total)
        else:
            self.sent.zero_()
            self.step.error = self.step.error[:0]  # no rows, so no errors
        self.processes.sum(self.sent)
        self.adam.step(self.gradients, share)
        return self.sent[-1].clone()

    def _masks(self, rows: int, own: slice) -> list[Tensor]:
        """Draw the dropout masks of a batch of `rows` rows, and return those of the rows `own`."""
        masks = self.step.masks(rows, own)
        if self.undropped is not None:
            masks[self.step.input_mask][:, self.undropped] = 1.0
        return masks


# Keeps a network symmetric during its training: mirrored inputs then give exactly the mirrored outputs.
#
# A data set with `mirror: true` has every clip and its mirror image, so the network that fits it best is
# symmetric. But the first weights and the order of the samples are not symmetric, and the difference between
# left and right grows during the training. A symmetric network also learns more: a clip with a hurt right
# thigh shows it how a hurt left thigh moves, too.


# The network is made symmetric after every 16 steps. To do so after each step would take longer and would not
# improve the weights.
STEPS_BETWEEN = 16


class Symmetry:
    """Keeps a network symmetric while it trains on a database.

    The property `why_not_symmetric` of the network's options must be empty; else it says why the network
    cannot be symmetric. Raises HobbleError if the skeleton has no mirror image, or if left and right columns
    are standardised differently.
    """

    def __init__(self, network: TrainableBlend, database: Database) -> None:
        layout, statistics = database.layout, database.statistics
        skeleton = Skeleton.from_dict(database.skeleton)
        inputs = mirror_of_x(layout, skeleton).for_standardised_rows(statistics.x_mean, statistics.x_std)
        outputs = mirror_of_y(layout, skeleton).for_standardised_rows(statistics.y_mean, statistics.y_std)
        self.layers = list(zip(network.layers, network.mirrors(inputs, outputs), strict=True))

    def make_new_network_symmetric(self) -> None:
        """Make the random weights of a new network symmetric.

        Each weight becomes the mean of two independent random weights, which halves the variance. So the
        weights, but not the biases, are then multiplied by sqrt(2).
        """
        self.enforce()
        for layer, _ in self.layers:
            layer[:, :, :-1].mul_(2**0.5)
        self.enforce()  # again, because the symmetric biases depend on the weights

    def enforce(self) -> None:
        """Replace each layer by the mean of itself and its mirror image."""
        for layer, mirror in self.layers:
            layer.add_(mirror_image(layer, mirror)).mul_(0.5)


def mirror_image(layer: Tensor, mirror: LayerMirror) -> Tensor:
    """The mirror image (out, K, in + 1) of a layer.

    A layer y = W x + b is symmetric if mirrored inputs, half a cycle later, give mirrored outputs. The mirror
    images of x and y are x' = M x + d and y' = N y + e. M and N are permutations with signs, and each is its
    own inverse; d and e are shifts. The mirror image of (W, b) is (N W M, N (W d + b) + e), with the W and b
    of half a cycle later. Mirroring twice gives the same layer, so the mean of a layer and its mirror image
    is symmetric.
    """
    inputs, outputs = mirror.inputs, mirror.outputs
    swapped = layer.roll(mirror.half_cycle, 1)[torch.from_numpy(outputs.source).to(layer.device)]
    weights, biases = swapped[:, :, :-1], swapped[:, :, -1]
    signs, input_signs, shift, input_shift = (
        torch.from_numpy(numbers).to(layer.device, layer.dtype)
        for numbers in (outputs.sign, inputs.sign, outputs.shift, inputs.shift)
    )
    weights_across = weights[:, :, torch.from_numpy(inputs.source).to(layer.device)]
    biases = signs[:, None] * (biases + weights @ input_shift) + shift[:, None]
    return torch.cat([weights_across * (signs[:, None, None] * input_signs), biases[:, :, None]], dim=2)
