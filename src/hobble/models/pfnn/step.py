"""Loss and gradient of one batch, computed with three large matrix products for each layer.

A batch has B rows. For each layer, x (B, in) are the inputs and a (B, out) the outputs. c (B, K) are the
coefficients of the K control points. e (B, K (in + 1)) are the inputs with a 1 appended, times each of the K
coefficients. W (out, K (in + 1)) are weights and biases of all control points. da, dW, de and dx are the
gradients of the loss by these arrays, de_k is the part of de for control point k without the column of the 1,
and ' transposes a matrix:

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
    dropout: share of units dropped before each layer, inputs included. The other units are scaled up.
    half: round the factors of the products to bfloat16. Sums and everything else stay float32.
    gradients: of the last call, (out, K (in + 1)) for each layer, in bfloat16 with `half`.
    error: of the last call, (B, Y), prediction minus y.

    keep: 1 - dropout. factors: the parameters as factors of the products, in bfloat16 with `half`. widths:
    number of inputs of each layer. generator, input_mask: see `hobble.models.trainable.TrainingStep`.
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

        p: phases. masks: one for each layer, from the method `masks`.
        """
        if self.half:
            self.factors.copy_(self.network.flat)
        weights = [layer.flatten(1) for layer in self.network.views(self.factors)]
        c = self.coefficients(p)
        expanded, slopes = [], []
        for number, weight in enumerate(weights):
            x = torch.nn.functional.elu(x) if number else x
            e, slope = self.expand_inputs(number, x, c, masks[number])
            expanded.append(e)
            slopes.append(slope)
            x = self.multiply(f"outputs {number}", e, weight).to(y.dtype)
        self.error = x.sub_(y)
        d = self.error * (2.0 / y.numel())  # gradient of the mean square by the prediction
        self.gradients = [d] * len(weights)  # each is replaced below
        for number in range(len(weights) - 1, -1, -1):
            d = d.to(self.factors.dtype)
            self.gradients[number] = self.multiply(f"gradient {number}", d.T, expanded[number].T)
            if number:
                de = self.multiply(f"inputs {number}", d, weights[number].T)
                d = self.contract_gradient(number, de, c, slopes[number])
        return torch.mean(torch.square(self.error))

    def seed(self, seed: int) -> None:
        """Start a new sequence of dropout masks, 0 <= seed < 2^63."""
        self.generator.manual_seed(seed)

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """Draw the dropout masks of a batch of `rows` rows, and return those of the rows `own`.

        Each layer has a mask (rows, in): 0 where an input is dropped, else 1 / keep.
        """
        flat, widths = self.network.flat, self.widths
        drawn = torch.rand(rows, sum(widths), generator=self.generator, device=flat.device)[own]
        return list((drawn < self.keep).to(flat.dtype).mul_(1.0 / self.keep).split(widths, dim=1))

    def multiply(self, name: str, a: Tensor, b: Tensor) -> Tensor:
        """a @ b.T. name: names the result's buffer in the fused step (`hobble.models.fused_base`)."""
        return product(a, b)

    def coefficients(self, p: Tensor) -> Tensor:
        """Spline coefficients (B, K) of phases (B,)."""
        return coefficients(p, self.network.control_points)

    def expand_inputs(self, number: int, x: Tensor, c: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
        """For layer `number`: e (B, K (n + 1)) of its inputs x (B, n) times the mask, and slopes (B, n).

        A slope is the mask times the derivative of the ELU that gave x. The derivative is x + 1 where x is
        below 0, else 1. In layer 0 x comes from no ELU, and the slopes are not used.
        """
        return expand(x * mask, c).to(self.factors.dtype), mask * torch.clamp(x + 1, max=1)

    def contract_gradient(self, number: int, de: Tensor, c: Tensor, slope: Tensor) -> Tensor:
        """The gradient (B, n) by the outputs of the previous layer, before their ELU.

        number: of the layer whose inputs they are. de: (B, K (n + 1)) the gradient by e of this layer. c:
        (B, K) spline coefficients. slope: (B, n) from `expand_inputs`.
        """
        parts = de.to(c.dtype).view(len(c), c.shape[1], -1)[:, :, :-1]
        return torch.bmm(c[:, None, :], parts)[:, 0, :] * slope
