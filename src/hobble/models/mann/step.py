"""Loss and gradient of one batch, written out as three large products for each layer of experts.

h: inputs of a layer with a 1 appended; W: weights and biases of all experts, (K out, in + 1); a: outputs of
all experts, (B, K out); c: shares, (B, K). dX is the gradient of the loss by X, and X' is X transposed:

    a = h W'    out = sum_k c_k a_k    da_k = c_k dout    dW = da' h    dh = da W    dc_k = dout . a_k

Because the experts' outputs are blended, not their weights, dc needs no further matrix product. In the first
layer dh is not needed.
"""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.models.mann.trainable import TrainableMann, with_one
from hobble.models.products import product
from hobble.models.trainable import ALL_ROWS

# The masked inputs of a layer with a 1 appended, and the slopes; see `MannStep.prepared`.
Kept = tuple[Tensor, Tensor]


class MannStep:
    """The gradient of the mean squared error of a network under dropout, in PyTorch, on any device.

    network: the network in training, read at every call. dropout: share of units dropped before each layer of
    the gate and of the experts, inputs included. half: round the factors of the experts' products to
    bfloat16. gradients, error: see `hobble.models.trainable.TrainingStep`.
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
        # Layers and masks of the gate come first, then those of the experts, whose first layer gets X.
        self.gate_layers = self.input_mask = len(network.gate_sizes) - 1
        self.widths = (*network.gate_sizes[:-1], *network.sizes[:-1])

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """Compute `gradients` for x (B, X) and y (B, Y). Returns the mean squared error, a scalar tensor.

        masks: one for each layer, from `masks`. p is ignored.
        """
        if self.half:
            self.factors.copy_(self.network.flat)
        weights = [layer.flatten(1) for layer in self.network.views(self.factors)[self.gate_layers :]]
        c, kept_of_gate = self._gate(x, masks)
        kept, outputs = [], []
        for number, weight in enumerate(weights):
            x = torch.nn.functional.elu(x) if number else x
            kept.append(self.prepared(number, x, masks[self.gate_layers + number]))
            outputs.append(self.multiplied(f"outputs {number}", kept[-1][0], weight))
            x = self.blended(number, outputs[-1], c)
        self.error = x.sub_(y)
        d = self.error * (2.0 / y.numel())
        dc = torch.zeros_like(c)
        gradients = [d] * len(weights)
        for number in range(len(weights) - 1, -1, -1):
            da = self.spread(number, d, outputs[number], c, dc)
            gradients[number] = self.multiplied(f"gradient {number}", da.T, kept[number][0].T)
            if number:
                dh = self.multiplied(f"of inputs {number}", da, weights[number].T)
                d = self.sloped(number, dh, kept[number][1])
        self.gradients = [*self._gate_gradients(c, dc, kept_of_gate), *gradients]
        return torch.mean(torch.square(self.error))

    def seed(self, seed: int) -> None:
        """Start a new sequence of dropout masks, 0 <= seed < 2^63."""
        self.generator.manual_seed(seed)

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """Draw the dropout masks of `rows` rows, and return those of the rows `own`.

        A mask (rows, in) for each layer, the gate's first: 0 where an input is dropped, else 1 / keep.
        """
        flat = self.network.flat
        drawn = torch.rand(rows, sum(self.widths), generator=self.generator, device=flat.device)[own]
        return list((drawn < self.keep).to(flat.dtype).mul_(1.0 / self.keep).split(self.widths, dim=1))

    def multiplied(self, name: str, a: Tensor, b: Tensor) -> Tensor:
        """a @ b.T. name: of this product, for the buffers of the fused step (`hobble.models.fused_base`)."""
        return product(a, b)

    def prepared(self, number: int, x: Tensor, mask: Tensor) -> Kept:
        """Layer `number`'s masked inputs x (B, n) with a 1 appended, and the slopes (B, n).

        x is the result of an ELU (in layer 0, the slopes are not used). A slope is the derivative of that
        ELU times the mask. The derivative is x + 1 where x is below 0, else 1.
        """
        return with_one(x * mask).to(self.factors.dtype), mask * torch.clamp(x + 1, max=1)

    def blended(self, number: int, outputs: Tensor, c: Tensor) -> Tensor:
        """The outputs of all experts (B, K out), blended with the shares c (B, K): (B, out)."""
        each = outputs.view(len(c), c.shape[1], -1).to(c.dtype)
        return torch.bmm(c[:, None, :], each)[:, 0]

    def spread(self, number: int, d: Tensor, outputs: Tensor, c: Tensor, dc: Tensor) -> Tensor:
        """The gradient (B, K out) by all experts' outputs, from the gradient d (B, out) by the blend.

        Adds the layer's part of the gradient by the shares c (B, K) to dc (B, K).
        """
        each = outputs.view(len(c), c.shape[1], -1).to(c.dtype)
        dc += torch.bmm(each, d[:, :, None])[:, :, 0]
        return (c[:, :, None] * d[:, None, :]).flatten(1).to(self.factors.dtype)

    def sloped(self, number: int, d: Tensor, slope: Tensor) -> Tensor:
        """The gradient (B, n) by the values before the ELU in front of layer `number`.

        d: (B, n + 1) the gradient by the layer's inputs. slope: (B, n) from `prepared`.
        """
        return d[:, :-1].to(slope.dtype) * slope

    def _gate(self, x: Tensor, masks: list[Tensor]) -> tuple[Tensor, list[Kept]]:
        """The shares (B, K) for x (B, X), and what the gradient needs of each layer."""
        h, kept = x[:, self.columns], []
        for number, layer in enumerate(self.network.layers[: self.gate_layers]):
            h = torch.nn.functional.elu(h) if number else h
            kept.append((with_one(h * masks[number]), masks[number] * torch.clamp(h + 1, max=1)))
            h = torch.mm(kept[-1][0], layer.flatten(1).T)
        return torch.softmax(h, dim=1), kept

    def _gate_gradients(self, c: Tensor, dc: Tensor, kept: list[Kept]) -> list[Tensor]:
        """Gradients (out, in + 1) by the gate's layers. c: (B, K) shares. dc: (B, K) the gradient by them."""
        d = c * (dc - torch.sum(c * dc, dim=1, keepdim=True))
        gradients: list[Tensor] = []
        for number in range(self.gate_layers - 1, -1, -1):
            gradient = torch.mm(d.T, kept[number][0])
            # The optimiser needs all gradients in one type.
            gradients.insert(0, gradient.to(self.factors.dtype))
            if number:
                d = torch.mm(d, self.network.layers[number].flatten(1))[:, :-1] * kept[number][1]
        return gradients
