"""Loss and gradient of one batch, written out as three large products for each layer.

e: inputs x of a layer with a 1 appended, times each of the K spline coefficients c, (B, K (in + 1)); W:
weights and biases, (out, K (in + 1)); a: outputs, (B, out). dX is the gradient of the loss
by X, and X' is X transposed:

    a = e W'        dW = da' e        de = da W        dx = sum_k c_k de_k

Blending the weights for each sample would give the same result, because sum_k c_k (W_k x) =
(sum_k c_k W_k) x, but it would take several times the memory traffic.
"""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.models.pfnn.trainable import TrainablePfnn, coefficients, expand
from hobble.models.products import product
from hobble.models.trainable import ALL_ROWS


class PfnnStep:
    """The gradient of the mean squared error of a network under dropout, in PyTorch, on any device.

    network: the network in training, read at every call.
    dropout: share of units dropped before each layer, inputs included; the units kept are scaled up.
    half: round the factors of the products to bfloat16; sums and everything else stay float32.
    gradients: of the last call, (out, K (in + 1)) for each layer, in bfloat16 with `half`.
    error: of the last call, (B, Y), prediction minus y.
    """

    def __init__(self, network: TrainablePfnn, dropout: float, half: bool = False) -> None:
        self.network = network
        self.keep = 1.0 - dropout
        self.half = half
        self.factors = network.flat.to(torch.bfloat16) if half else network.flat
        self.generator = torch.Generator(network.flat.device)
        self.gradients: list[Tensor] = []
        self.error = torch.empty(0, network.sizes[-1], device=network.flat.device)
        self.widths = network.sizes[:-1]
        self.input_mask = 0

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """Compute `gradients` for x (B, X), y (B, Y), p (B,). Returns the mean squared error, a scalar.

        masks: one for each layer, from `masks`.
        """
        if self.half:
            self.factors.copy_(self.network.flat)
        weights = [layer.flatten(1) for layer in self.network.views(self.factors)]
        c = self.coefficients(p)
        expanded, slopes = [], []
        for number, weight in enumerate(weights):
            x = torch.nn.functional.elu(x) if number else x
            e, slope = self.expanded(number, x, c, masks[number])
            expanded.append(e)
            slopes.append(slope)
            x = self.multiplied(f"outputs {number}", e, weight).to(y.dtype)
        self.error = x.sub_(y)
        d = self.error * (2.0 / y.numel())
        self.gradients = [d] * len(weights)
        for number in range(len(weights) - 1, -1, -1):
            d = d.to(self.factors.dtype)
            self.gradients[number] = self.multiplied(f"gradient {number}", d.T, expanded[number].T)
            if number:
                de = self.multiplied(f"inputs {number}", d, weights[number].T)
                d = self.contracted(number, de, c, slopes[number])
        return torch.mean(torch.square(self.error))

    def seed(self, seed: int) -> None:
        """Start a new sequence of dropout masks, 0 <= seed < 2^63."""
        self.generator.manual_seed(seed)

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """Draw the dropout masks of `rows` rows, and return those of the rows `own`.

        A mask (rows, in) for each layer: 0 where an input is dropped, else 1 / keep.
        """
        flat, widths = self.network.flat, self.widths
        drawn = torch.rand(rows, sum(widths), generator=self.generator, device=flat.device)[own]
        return list((drawn < self.keep).to(flat.dtype).mul_(1.0 / self.keep).split(widths, dim=1))

    def multiplied(self, name: str, a: Tensor, b: Tensor) -> Tensor:
        """a @ b.T. name: of this product, for the buffers of the fused step (`hobble.models.fused_base`)."""
        return product(a, b)

    def coefficients(self, p: Tensor) -> Tensor:
        """Spline coefficients (B, K) of phases (B,)."""
        return coefficients(p, self.network.control_points)

    def expanded(self, number: int, x: Tensor, c: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
        """Layer `number`'s masked inputs x (B, n), expanded to (B, K (n + 1)), and the slopes (B, n).

        x is the result of an ELU (in layer 0, the slopes are not used). A slope is the derivative of that
        ELU times the mask. The derivative is x + 1 where x is below 0, else 1.
        """
        return expand(x * mask, c).to(self.factors.dtype), mask * torch.clamp(x + 1, max=1)

    def contracted(self, number: int, de: Tensor, c: Tensor, slope: Tensor) -> Tensor:
        """The gradient (B, n) by the values before the ELU in front of layer `number`.

        de: (B, K (n + 1)) the gradient by the layer's expanded inputs. c: (B, K) spline coefficients. slope:
        (B, n) from `expanded`.
        """
        parts = de.to(c.dtype).view(len(c), c.shape[1], -1)[:, :, :-1]
        return torch.bmm(c[:, None, :], parts)[:, 0, :] * slope
