"""The optimiser Adam, which also adds the gradient of the L1 term of the loss."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor

from hobble.core.compiled import njit
from hobble.models.kernels import as_numpy, to_float32, use_threads
from hobble.models.trainable import Trainable

EPSILON = 1e-8  # added to the root of the second moment, so that nothing is divided by 0


def l1_slopes(network: Trainable, l1: float) -> list[float]:
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
        self, network: Trainable, learning_rate: float, beta1: float, beta2: float, l1: float
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
        if self.network.flat.device.type == "cpu":
            self._step_on_cpu(gradients, *self.step_factors(share))
        else:
            factors = torch.tensor(self.step_factors(share))
            self.step_with_torch(gradients, factors.to(self.network.flat.device, non_blocking=True))

    def step_factors(self, share: float) -> tuple[float, float]:
        """The factors that change from step to step: (rate, root).

        rate: learning rate with the bias correction of the first moment. root: the bias correction by which
        the square root of the second moment is multiplied.
        """
        steps = max(self.steps, 1)  # without this, the factors before the first step would divide by 0
        rate = share * self.learning_rate / (1 - self.beta1**steps)
        return rate, 1 / (1 - self.beta2**steps) ** 0.5

    def _step_on_cpu(self, gradients: list[Tensor], rate: float, root: float) -> None:
        """Take the step on a CPU. One loop goes through memory once, because memory limits the speed."""
        views = [
            self.network.layers,
            self.network.views(self.first_moment),
            self.network.views(self.second_moment),
        ]
        for *tensors, gradient, slope in zip(*views, gradients, self.slopes, strict=True):
            arrays = [as_numpy(tensor.flatten(0, 1)) for tensor in tensors]  # w, m and v of `_adam_loop`
            arrays.append(as_numpy(gradient.view(tensors[0].shape).flatten(0, 1)))
            use_threads(tensors[0].numel())
            numbers = (self.beta1, self.beta2, rate, root, slope, EPSILON)
            _adam_loop(*arrays, *(arrays[0].dtype.type(number) for number in numbers))

    def step_with_torch(self, gradients: list[Tensor], factors: Tensor) -> None:
        """Take the step in PyTorch, on any device. factors: (2,) from `step_factors`, on the device."""
        rate, root = factors.to(self.network.flat.dtype).unbind()
        views = [
            self.network.layers,
            self.network.views(self.first_moment),
            self.network.views(self.second_moment),
        ]
        for w, m, v, gradient, slope in zip(*views, gradients, self.slopes, strict=True):
            g = gradient.view(w.shape).to(w.dtype, copy=True)
            g[:, :, :-1].add_(torch.sign(w[:, :, :-1]), alpha=slope)
            m.lerp_(g, 1 - self.beta1)
            v.mul_(self.beta2).addcmul_(g, g, value=1 - self.beta2)
            w.addcdiv_(m * -rate, v.sqrt().mul_(root).add_(EPSILON))


@njit(parallel=True, error_model="numpy")
def _adam_loop(
    w: Any, m: Any, v: Any, g: Any, b1: Any, b2: Any, rate: Any, root: Any, slope: Any, epsilon: Any
) -> None:
    """One step of Adam on a layer: parameters w, moments m and v, and gradient g, all (rows, in + 1).

    b1, b2: beta1 and beta2. rate, root: see `Adam.step_factors`. slope: see `l1_slopes`. g may be bfloat16,
    whose bits are in uint16.
    """
    one, zero = w.dtype.type(1), w.dtype.type(0)
    last = w.shape[1] - 1
    half = g.itemsize == 2  # g is bfloat16
    for row in numba.prange(w.shape[0]):
        for i in range(w.shape[1]):
            d = w.dtype.type(to_float32(g[row, i])) if half else w.dtype.type(g[row, i])
            if i < last:  # the last column holds the biases
                d += slope * (one if w[row, i] > zero else (-one if w[row, i] < zero else zero))
            m[row, i] = b1 * m[row, i] + (one - b1) * d
            v[row, i] = b2 * v[row, i] + (one - b2) * d * d
            w[row, i] -= rate * m[row, i] / (root * np.sqrt(v[row, i]) + epsilon)
