"""Adam, with the L1 term of the loss and weight decay, in one sweep over the flat parameters."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor

from hobble.training.fused import bits, team, widened
from hobble.training.network import Network

EPSILON = 1e-8


def l1_slopes(network: Network, l1: float) -> list[float]:
    """What the L1 term adds to the gradient of a weight, times its sign, for each layer.

    The term is l1 * sum over the layers of mean|W| / (2 * layers): the original divides by the number of its
    parameter arrays, three of weights and three of biases.
    """
    layers = network.layers
    return [l1 / (2 * len(layers)) / layer[:, :, :-1].numel() for layer in layers]


class Adam:
    """Adam (Kingma and Ba 2015) on `network.flat`; it adds the gradient of the L1 term itself.

    weight_decay: share of its weights, not its biases, that the network loses in a step at a rate of 1, apart
    from the gradient (AdamW, Loshchilov and Hutter 2019). first, second: the running moments, laid out like
    `network.flat`. steps: how many were made.
    """

    def __init__(
        self,
        network: Network,
        learning_rate: float,
        beta1: float,
        beta2: float,
        l1: float,
        weight_decay: float = 0.0,
    ) -> None:
        self.network = network
        self.learning_rate, self.beta1, self.beta2 = learning_rate, beta1, beta2
        self.weight_decay = weight_decay
        self.slopes = l1_slopes(network, l1)
        self.steps = 0
        self.first = torch.zeros_like(network.flat)
        self.second = torch.zeros_like(network.flat)

    def step(self, gradients: list[Tensor], share: float = 1.0) -> None:
        """Move the parameters by one step against `gradients`, (out, K (in + 1)) for each layer.

        share: of the learning rate.
        """
        self.steps += 1
        rate = share * self.learning_rate / (1 - self.beta1**self.steps)
        keep = 1 - share * self.learning_rate * self.weight_decay
        root = 1 / (1 - self.beta2**self.steps) ** 0.5
        sweep = _sweep_on_cpu if self.first.device.type == "cpu" else _sweep
        views = [self.network.layers, self.network.views(self.first), self.network.views(self.second)]
        for w, m, v, g, slope in zip(*views, gradients, self.slopes, strict=True):
            sweep(w, m, v, g.view(w.shape), self.beta1, self.beta2, rate, root, keep, slope)


def _sweep(
    w: Tensor,
    m: Tensor,
    v: Tensor,
    g: Tensor,
    b1: float,
    b2: float,
    rate: float,
    root: float,
    keep: float,
    slope: float,
) -> None:
    """One layer of weights, moments and gradient, each (out, K, in + 1), in PyTorch."""
    g = g.to(w.dtype, copy=True)
    g[:, :, :-1] += slope * torch.sign(w[:, :, :-1])
    m.mul_(b1).add_(g, alpha=1 - b1)
    v.mul_(b2).addcmul_(g, g, value=1 - b2)
    w[:, :, :-1] *= keep
    w.addcdiv_(m, v.sqrt().mul_(root).add_(EPSILON), value=-rate)


def _sweep_on_cpu(w: Tensor, m: Tensor, v: Tensor, g: Tensor, *numbers: float) -> None:
    """The same in one pass over memory, whose bandwidth is all that bounds it."""
    arrays = [bits(array.flatten(0, 1)) for array in (w, m, v, g)]
    team(w.numel())
    _fused(*arrays, *(arrays[0].dtype.type(n) for n in (*numbers, EPSILON)))


@numba.njit(parallel=True, error_model="numpy", cache=True)
def _fused(
    w: Any,
    m: Any,
    v: Any,
    g: Any,
    b1: Any,
    b2: Any,
    rate: Any,
    root: Any,
    keep: Any,
    slope: Any,
    epsilon: Any,
) -> None:
    one, zero = w.dtype.type(1), w.dtype.type(0)
    last = w.shape[1] - 1
    half = g.itemsize == 2
    for row in numba.prange(w.shape[0]):
        for i in range(w.shape[1]):
            d = w.dtype.type(widened(g[row, i])) if half else w.dtype.type(g[row, i])
            kept = one
            if i < last:  # the last column holds the biases
                d += slope * (one if w[row, i] > zero else (-one if w[row, i] < zero else zero))
                kept = keep
            m[row, i] = b1 * m[row, i] + (one - b1) * d
            v[row, i] = b2 * v[row, i] + (one - b2) * d * d
            w[row, i] = kept * w[row, i] - rate * m[row, i] / (root * np.sqrt(v[row, i]) + epsilon)
