"""One batch: loss and gradient by hand, as three large products for each layer of experts.

With h the inputs of a layer, a 1 behind them, W the weights and biases of all experts, (K out, in + 1), a the
outputs of all experts, (B, K out), and c the shares, (B, K):

    a = h W'    out = sum_k c_k a_k    da = c_k dout    dW = da' h    dh = da W    dc_k = dout . a_k

The experts' outputs are blended and not their weights, which gives the gradient of the shares without another
product, and their inputs need none in the first layer.
"""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.models.mann.trainable import TrainableMann, with_one
from hobble.models.products import product
from hobble.models.trainable import ALL_ROWS

Kept = tuple[Tensor, Tensor]


class Step:
    """The gradient of the mean squared error of a network under dropout, in PyTorch, on any device.

    network: what is trained; read anew at every call. dropout: share of units dropped before each layer of
    the gate and of the experts, the inputs included. half: round the factors of the experts' products to
    bfloat16. gradients, error: as in `hobble.models.trainable.Step`.
    """

    def __init__(self, network: TrainableMann, dropout: float, half: bool = False) -> None:
        self.network = network
        self.keep = 1.0 - dropout
        self.half = half
        self.factors = network.flat.to(torch.bfloat16) if half else network.flat
        self.generator = torch.Generator(network.flat.device)
        self.gradients: list[Tensor] = []
        self.error = torch.empty(0, network.sizes[-1], device=network.flat.device)
        self.columns = torch.tensor(network.columns, device=network.flat.device)
        self.gates = len(network.gate_sizes) - 1
        self.widths = (*network.gate_sizes[:-1], *network.sizes[:-1])

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """Find `gradients` for x (B, X) and y (B, Y); returns the mean squared error, a scalar tensor.

        masks: one for each layer, as `masks` draws them. p is not looked at.
        """
        if self.half:
            self.factors.copy_(self.network.flat)
        weights = [layer.flatten(1) for layer in self.network.views(self.factors)[self.gates :]]
        c, of_gate = self._gate(x, masks)
        kept, outputs = [], []
        for number, weight in enumerate(weights):
            x = torch.nn.functional.elu(x) if number else x
            kept.append(self.prepared(number, x, masks[self.gates + number]))
            outputs.append(product(kept[-1][0], weight))
            x = self.blended(number, outputs[-1], c)
        self.error = x.sub_(y)
        d = self.error * (2.0 / y.numel())
        dc = torch.zeros_like(c)
        gradients = [d] * len(weights)
        for number in range(len(weights) - 1, -1, -1):
            da = self.spread(number, d, outputs[number], c, dc)
            gradients[number] = product(da.T, kept[number][0].T)
            if number:
                d = self.sloped(number, product(da, weights[number].T), kept[number][1])
        self.gradients = [*self._gate_gradients(c, dc, of_gate), *gradients]
        return torch.mean(torch.square(self.error))

    def seed(self, seed: int) -> None:
        """Begin a new sequence of dropout masks, 0 <= seed < 2^63."""
        self.generator.manual_seed(seed)

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """What each layer's inputs (rows, in) are multiplied by, those of the gate first: 0 or 1 / keep."""
        flat = self.network.flat
        drawn = torch.rand(rows, sum(self.widths), generator=self.generator, device=flat.device)[own]
        return list((drawn < self.keep).to(flat.dtype).mul_(1.0 / self.keep).split(self.widths, dim=1))

    def prepared(self, number: int, x: Tensor, mask: Tensor) -> Kept:
        """Layer `number`'s inputs x (B, n) under its mask, a 1 behind them, and the slopes (B, n).

        The slope is that of the ELU which gave x, found from its value (e^a = x + 1 below 0), times the mask.
        """
        return with_one(x * mask).to(self.factors.dtype), mask * torch.clamp(x + 1, max=1)

    def blended(self, number: int, outputs: Tensor, c: Tensor) -> Tensor:
        """(B, out) of the outputs of all experts (B, K out) in the shares c (B, K)."""
        each = outputs.view(len(c), c.shape[1], -1).to(c.dtype)
        return torch.bmm(c[:, None, :], each)[:, 0]

    def spread(self, number: int, d: Tensor, outputs: Tensor, c: Tensor, dc: Tensor) -> Tensor:
        """The gradient (B, K out) of all experts' outputs from that of the blend, d (B, out).

        Adds what the layer says of the shares to dc (B, K).
        """
        each = outputs.view(len(c), c.shape[1], -1).to(c.dtype)
        dc += torch.bmm(each, d[:, :, None])[:, :, 0]
        return (c[:, :, None] * d[:, None, :]).flatten(1).to(self.factors.dtype)

    def sloped(self, number: int, d: Tensor, slope: Tensor) -> Tensor:
        """(B, n): the gradient before layer `number`'s ELU, from that of its inputs and the 1, (B, n + 1)."""
        return d[:, :-1].to(slope.dtype) * slope

    def _gate(self, x: Tensor, masks: list[Tensor]) -> tuple[Tensor, list[Kept]]:
        """The shares (B, K) of x (B, X), and what its gradient needs of each layer."""
        h, kept = x[:, self.columns], []
        for number, layer in enumerate(self.network.layers[: self.gates]):
            h = torch.nn.functional.elu(h) if number else h
            kept.append((with_one(h * masks[number]), masks[number] * torch.clamp(h + 1, max=1)))
            h = torch.mm(kept[-1][0], layer.flatten(1).T)
        return torch.softmax(h, dim=1), kept

    def _gate_gradients(self, c: Tensor, dc: Tensor, kept: list[Kept]) -> list[Tensor]:
        """Of each layer of the gate, (out, in + 1), from the gradient dc (B, K) of the shares c (B, K)."""
        d = c * (dc - torch.sum(c * dc, dim=1, keepdim=True))
        found: list[Tensor] = []
        for number in range(self.gates - 1, -1, -1):
            gradient = torch.mm(d.T, kept[number][0])
            # The optimiser takes all gradients in one type.
            found.insert(0, gradient.to(self.factors.dtype))
            if number:
                d = torch.mm(d, self.network.layers[number].flatten(1))[:, :-1] * kept[number][1]
        return found
