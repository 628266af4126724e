"""Blended stacks as the papers define them: slow and plain, each sample's weights are blended first, and
autograd finds the gradient. Also small networks of each kind.
"""

from math import prod
from typing import Any

import torch
from torch import Tensor

from hobble.models.blend import TrainableBlend
from hobble.models.mann import TrainableMann
from hobble.models.plain import TrainablePlain


def new(kind: type[TrainableBlend], *arguments: Any, seed: int = 1) -> Any:
    """An untrained network. arguments: those of the class after `flat`."""
    shapes = kind(None, *arguments).shapes  # type: ignore[arg-type]
    return kind(torch.zeros(sum(map(prod, shapes))), *arguments).randomise(seed)


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


def stacked(layers: list[Tensor], x: Tensor, masks: list[Tensor]) -> Tensor:
    """Layers (out, in + 1) applied to one sample."""
    for number, layer in enumerate(layers):
        x = x if number == 0 else torch.where(x > 0, x, torch.exp(x) - 1)
        x = layer[:, :-1] @ (x * masks[number]) + layer[:, -1]
    return x


def output(network: TrainableBlend, layers: list[Tensor], x: Tensor, p: float, masks: list[Tensor]) -> Tensor:
    """(Y,) of one sample x (X,). masks (in,): one for each layer, those of the gate first."""
    gates = network.gate_layers
    own = layers[gates:]
    if isinstance(network, TrainableMann):
        gate = [layer[:, 0] for layer in layers[:gates]]
        logits = stacked(gate, torch.stack([x[column] for column in network.columns]), masks[:gates])
        shares = torch.exp(logits) / torch.exp(logits).sum()
        blended = [torch.einsum("k,oki->oi", shares, layer) for layer in own]
    elif isinstance(network, TrainablePlain):
        angle = torch.tensor([2 * torch.pi * p], dtype=x.dtype)
        x, blended = torch.cat([x, torch.sin(angle), torch.cos(angle)]), [layer[:, 0] for layer in own]
    else:
        blended = [spline(layer.transpose(0, 1), p) for layer in own]
    return stacked(blended, x, masks[gates:])


def loss(
    network: TrainableBlend, layers: list[Tensor], x: Tensor, y: Tensor, p: Tensor, masks: Any
) -> Tensor:
    """The mean squared error of a batch."""
    rows = [output(network, layers, x[i], float(p[i]), [m[i] for m in masks]) for i in range(len(x))]
    return torch.mean((torch.stack(rows) - y) ** 2)
