"""Loss and gradient of one batch, with three large matrix products for each layer of the K experts.

In a layer, for a batch of B rows: h (B, in + 1) are the inputs with a 1 appended; W (K out, in + 1) the
weights and biases of all experts; a (B, K out) the outputs of all experts; c (B, K) the shares in which they
are blended; blend (B, out) the result. dX is the gradient of the loss by X, and X' is X transposed:

    a = h W'    blend = sum_k c_k a_k
    da_k = c_k dblend    dW = da' h    dh = da W    dc_k = dblend . a_k

Because the experts' outputs are blended, not their weights, dc needs no further matrix product. In the first
layer dh is not needed, because it would be the gradient by the network's inputs.
"""

from __future__ import annotations

import torch
from torch import Tensor

from hobble.models.mann.trainable import TrainableMann, with_one
from hobble.models.products import product
from hobble.models.trainable import ALL_ROWS

# What the gradient needs of a layer: its inputs and slopes, as `MannStep.prepare_inputs` returns them.
Saved = tuple[Tensor, Tensor]


class MannStep:
    """Computes the gradient of the mean squared error of a network with dropout, in PyTorch, on any device.

    network: the network in training; its parameters are read anew in every call. dropout: share of units
    dropped before each layer of the gate and of the experts, network inputs included. half: round the factors
    of the experts' matrix products to bfloat16. factors: the parameters, rounded if `half`. widths: number of
    inputs of each layer, the gate's layers first. gradients, error: see
    `hobble.models.trainable.TrainingStep`.
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
        # Layers and masks of the gate come first, then those of the experts. So the mask with the index
        # `gate_layers` is for the first layer of the experts, which gets X.
        self.gate_layers = self.input_mask = len(network.gate_sizes) - 1
        self.widths = (*network.gate_sizes[:-1], *network.sizes[:-1])

    def __call__(self, x: Tensor, y: Tensor, p: Tensor, masks: list[Tensor]) -> Tensor:
        """Compute `gradients` for x (B, X) and y (B, Y). Returns the mean squared error, a scalar tensor.

        masks: one for each layer, from the method `masks`. p, the phases, is ignored.
        """
        if self.half:
            self.factors.copy_(self.network.flat)
        weights = [layer.flatten(1) for layer in self.network.views(self.factors)[self.gate_layers :]]
        c, saved_of_gate = self._evaluate_gate(x, masks)
        saved, outputs = [], []
        for number, weight in enumerate(weights):
            x = torch.nn.functional.elu(x) if number else x
            saved.append(self.prepare_inputs(number, x, masks[self.gate_layers + number]))
            outputs.append(self.multiply(f"outputs {number}", saved[-1][0], weight))
            x = self.blend_experts(number, outputs[-1], c)
        self.error = x.sub_(y)
        dblend = self.error * (2.0 / y.numel())  # of the last layer, whose blend is the prediction
        dc = torch.zeros_like(c)
        gradients = [dblend] * len(weights)
        for number in range(len(weights) - 1, -1, -1):
            da = self.gradient_by_experts(number, dblend, outputs[number], c, dc)
            gradients[number] = self.multiply(f"gradient {number}", da.T, saved[number][0].T)
            if number:
                dh = self.multiply(f"of inputs {number}", da, weights[number].T)
                dblend = self.gradient_before_elu(dh, saved[number][1])
        self.gradients = [*self._gate_gradients(c, dc, saved_of_gate), *gradients]
        return torch.mean(torch.square(self.error))

    def seed(self, seed: int) -> None:
        """Start a new sequence of dropout masks, 0 <= seed < 2^63."""
        self.generator.manual_seed(seed)

    def masks(self, rows: int, own: slice = ALL_ROWS) -> list[Tensor]:
        """Draw the dropout masks of `rows` rows, and return those of the rows `own`.

        A mask (own rows, in) for each layer, the gate's first: 0 where an input is dropped, else 1 / keep.
        """
        flat = self.network.flat
        drawn = torch.rand(rows, sum(self.widths), generator=self.generator, device=flat.device)[own]
        return list((drawn < self.keep).to(flat.dtype).mul_(1.0 / self.keep).split(self.widths, dim=1))

    def multiply(self, name: str, a: Tensor, b: Tensor) -> Tensor:
        """a @ b.T. name: of the result's buffer in `hobble.models.fused_base`; not used here."""
        return product(a, b)

    def prepare_inputs(self, number: int, x: Tensor, mask: Tensor) -> Saved:
        """The inputs (B, n + 1) of layer `number`: x (B, n) times the mask, with a 1 appended; and slopes.

        The slopes (B, n) are the derivative of the ELU that computed x, times the mask. The derivative is
        x + 1 where x is below 0, else 1. No ELU comes before layer 0, so its slopes are not used.
        """
        return with_one(x * mask).to(self.factors.dtype), mask * torch.clamp(x + 1, max=1)

    def blend_experts(self, number: int, outputs: Tensor, c: Tensor) -> Tensor:
        """The blend (B, out) of the outputs (B, K out) of all experts, in the shares c (B, K)."""
        each = outputs.view(len(c), c.shape[1], -1).to(c.dtype)
        return torch.bmm(c[:, None, :], each)[:, 0]

    def gradient_by_experts(
        self, number: int, dblend: Tensor, outputs: Tensor, c: Tensor, dc: Tensor
    ) -> Tensor:
        """The gradient da (B, K out) by the outputs of all experts, from the gradient dblend (B, out).

        Adds the layer's part of the gradient by the shares c (B, K) to dc (B, K). outputs: (B, K out) of all
        experts.
        """
        each = outputs.view(len(c), c.shape[1], -1).to(c.dtype)
        dc += torch.bmm(each, dblend[:, :, None])[:, :, 0]
        return (c[:, :, None] * dblend[:, None, :]).flatten(1).to(self.factors.dtype)

    def gradient_before_elu(self, dh: Tensor, slope: Tensor) -> Tensor:
        """The gradient (B, n) by the values from which an ELU computed a layer's inputs.

        dh: (B, n + 1) the gradient by these inputs. slope: (B, n) from `prepare_inputs`.
        """
        return dh[:, :-1].to(slope.dtype) * slope

    def _evaluate_gate(self, x: Tensor, masks: list[Tensor]) -> tuple[Tensor, list[Saved]]:
        """The shares (B, K) for x (B, X), and what the gradient needs of each layer of the gate."""
        h, saved = x[:, self.columns], []
        for number, layer in enumerate(self.network.layers[: self.gate_layers]):
            h = torch.nn.functional.elu(h) if number else h
            saved.append((with_one(h * masks[number]), masks[number] * torch.clamp(h + 1, max=1)))
            h = torch.mm(saved[-1][0], layer.flatten(1).T)
        return torch.softmax(h, dim=1), saved

    def _gate_gradients(self, c: Tensor, dc: Tensor, saved: list[Saved]) -> list[Tensor]:
        """The gradients (out, in + 1) by the parameters of the gate's layers.

        c: (B, K) shares. dc: (B, K) the gradient by the shares. saved: from `_evaluate_gate`.
        """
        # The gradient by the logits, that is, by what the softmax turns into shares.
        doutputs = c * (dc - torch.sum(c * dc, dim=1, keepdim=True))
        gradients: list[Tensor] = []
        for number in range(self.gate_layers - 1, -1, -1):
            gradient = torch.mm(doutputs.T, saved[number][0])
            # The optimiser needs all gradients in one type.
            gradients.insert(0, gradient.to(self.factors.dtype))
            if number:
                dh = torch.mm(doutputs, self.network.layers[number].flatten(1))
                doutputs = dh[:, :-1] * saved[number][1]
        return gradients
