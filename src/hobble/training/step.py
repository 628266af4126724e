"""One batch: outputs, loss and gradient by hand, as few large products.

With e the inputs of a layer times the K spline coefficients, (B, K in), and W its weights, (K in, out):

    a = e W + c b        dW = e' da        db = c' da        de = da W'        dx = sum_k c_k de_k

which is the network with weights blended for each sample, since sum_k c_k (W_k x) = (sum_k c_k W_k) x.
"""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.training.network import Network, coefficients, expand


class Step:
    """The gradient of the mean squared error of a network under dropout.

    network: what is trained; read anew at every call. dropout: share of units dropped before each layer, the
    input included; the rest is scaled up to make up for it.
    """

    def __init__(self, network: Network, dropout: float) -> None:
        self.network = network
        self.keep = 1.0 - dropout
        self.gradient = torch.zeros_like(network.flat)
        self.weight_gradients, self.bias_gradients = network.views(self.gradient)

    def masks(self, rows: int, generator: torch.Generator) -> list[Tensor]:
        """What each layer's inputs are multiplied by: 0 with the probability `dropout`, else 1 / keep."""
        widths = self.network.sizes[:-1]
        flat = self.network.flat
        drawn = torch.rand(rows * sum(widths), generator=generator, device=flat.device, dtype=flat.dtype)
        drawn = (drawn < self.keep).to(flat.dtype).mul_(1.0 / self.keep)
        parts = torch.split(drawn, [rows * w for w in widths])
        return [part.view(rows, w) for part, w in zip(parts, widths, strict=True)]

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """Fill `self.gradient` for x (B, X), y (B, Y), p (B,); returns the loss, a scalar tensor."""
        network = self.network
        c = coefficients(p, network.control_points)
        units, expanded = [], []
        for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
            if layer:
                x = torch.nn.functional.elu(x)
            units.append(x)
            expanded.append(expand(x * masks[layer], c))
            x = torch.addmm(c @ bias, expanded[-1], weight.flatten(0, 1))
        error = x - y
        loss = torch.mean(error * error)
        d = error.mul_(2.0 / error.numel())
        for layer in range(len(network.weights) - 1, -1, -1):
            torch.mm(expanded[layer].T, d, out=self.weight_gradients[layer].flatten(0, 1))
            torch.mm(c.T, d, out=self.bias_gradients[layer])
            if layer:
                de = torch.mm(d, network.weights[layer].flatten(0, 1).T)
                d = torch.einsum("bk,bki->bi", c, de.view(len(c), network.control_points, -1))
                d *= masks[layer]
                d *= torch.clamp(units[layer] + 1, max=1)  # the slope of ELU, e^a below 0, from its value
        return loss
