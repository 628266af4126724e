"""The network, its loss and its training as the paper defines them: slow and plain, in float64, by
autograd.
"""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.models.pfnn.trainable import TrainablePfnn


def spline(control_points: Tensor, p: float) -> Tensor:
    """The cyclic cubic through control points (K, ...) at phase p: Hermite form with Catmull-Rom tangents."""
    k = len(control_points)
    position = (p % 1.0) * k
    at = int(position)
    t = position - at
    before, start, end, after = (control_points[(at + i) % k] for i in (-1, 0, 1, 2))
    leaving, arriving = (end - before) / 2, (after - start) / 2
    return (
        (1 + 2 * t) * (1 - t) ** 2 * start
        + t * (1 - t) ** 2 * leaving
        + t**2 * (3 - 2 * t) * end
        + t**2 * (t - 1) * arriving
    )


def output(layers: list[Tensor], x: Tensor, p: float, masks: list[Tensor]) -> Tensor:
    """One sample: weights (out, in) and bias (out,) are built for its phase, then applied layer by layer."""
    for number, layer in enumerate(layers):
        blended = spline(layer.transpose(0, 1), p)
        x = blended[:, :-1] @ (x * masks[number]) + blended[:, -1]
        if number < len(layers) - 1:
            x = torch.where(x > 0, x, torch.exp(x) - 1)
    return x


def loss(
    layers: list[Tensor], x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor], l1: float
) -> tuple[Tensor, Tensor]:
    """The mean squared error, and that plus the L1 term: l1 times the sum of mean|W| over 2 x layers."""
    rows = [output(layers, x[i], float(p[i]), [m[i] for m in masks]) for i in range(len(x))]
    error = torch.mean((torch.stack(rows) - y) ** 2)
    weights = sum(torch.mean(torch.abs(layer[:, :, :-1])) for layer in layers)
    return error, error + l1 * weights / (2 * len(layers))


def parameters(network: TrainablePfnn) -> list[Tensor]:
    """The network's layers, as tensors with gradients."""
    return [layer.clone().requires_grad_() for layer in network.layers]
