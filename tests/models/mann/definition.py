"""The network as the paper defines it, slow and plain: each sample's weights are blended first, and autograd
finds the gradient.
"""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.models.mann.trainable import TrainableMann


def output(network: TrainableMann, layers: list[Tensor], x: Tensor, masks: list[Tensor]) -> Tensor:
    """(Y,) of one sample x (X,). masks (in,): one for each layer, those of the gate first."""
    gates = len(network.gate_sizes) - 1
    h = torch.stack([x[column] for column in network.columns])
    for number, layer in enumerate(layers[:gates]):
        h = h if number == 0 else torch.where(h > 0, h, torch.exp(h) - 1)
        h = layer[:, 0, :-1] @ (h * masks[number]) + layer[:, 0, -1]
    shares = torch.exp(h) / torch.exp(h).sum()
    for number, layer in enumerate(layers[gates:]):
        experts = layer.view(network.experts, -1, layer.shape[-1])
        blended = sum(shares[k] * experts[k] for k in range(network.experts))
        x = x if number == 0 else torch.where(x > 0, x, torch.exp(x) - 1)
        x = blended[:, :-1] @ (x * masks[gates + number]) + blended[:, -1]
    return x
