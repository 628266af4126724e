"""Makes each layer of a network symmetric, so that the network treats left and right alike."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from hobble.rows.layout import ColumnMirror


class LayerMirror(NamedTuple):
    """How to mirror a layer.

    The layer is (out, K, in + 1): K sets of weights, with the bias as the last column. If the weights depend
    on the phase, the K sets are spread evenly over a cycle.

    inputs: how the layer's inputs change if the motion is mirrored. outputs: the same for its outputs.
    half_cycle: number of sets in half a cycle; 0 if the weights do not depend on the phase.
    """

    inputs: ColumnMirror
    outputs: ColumnMirror
    half_cycle: int


class LayerSymmetry:
    """Makes the parameters of a layer equal to those of its mirror image.

    A layer y = W x + b is symmetric if mirrored inputs, half a cycle later, give mirrored outputs. The mirror
    images of x and y are x' = M x + d and y' = N y + e. M and N are permutations with signs, and each is its
    own inverse; d and e are shifts. The mirror image of (W, b) is (N W M, N (W d + b) + e), with the W and b
    of half a cycle later. Mirroring twice gives the same layer, so the mean of a layer and its mirror image
    is symmetric.
    """

    def __init__(self, layer: Tensor, mirror: LayerMirror) -> None:
        device = layer.device
        self.layer, self.half_cycle = layer, mirror.half_cycle
        self.input_source, self.output_source = (
            torch.from_numpy(columns.source).to(device) for columns in (mirror.inputs, mirror.outputs)
        )
        self.input_shift, self.output_shift = (
            torch.from_numpy(columns.shift).to(device, layer.dtype)
            for columns in (mirror.inputs, mirror.outputs)
        )
        signs = np.outer(mirror.outputs.sign, mirror.inputs.sign)
        self.weight_signs = torch.from_numpy(signs).to(device, layer.dtype)[:, None]
        self.bias_signs = torch.from_numpy(mirror.outputs.sign).to(device, layer.dtype)[:, None]

    def mirror_image(self) -> Tensor:
        """The mirror image (out, K, in + 1) of the layer."""
        swapped = self.layer.roll(self.half_cycle, 1)[self.output_source]
        weights, biases = swapped[:, :, :-1], swapped[:, :, -1]
        biases = self.bias_signs * (biases + weights @ self.input_shift) + self.output_shift[:, None]
        return torch.cat([weights[:, :, self.input_source] * self.weight_signs, biases[:, :, None]], dim=2)

    def enforce(self) -> None:
        """Replace the layer by the mean of itself and its mirror image."""
        self.layer.add_(self.mirror_image()).mul_(0.5)


def mirror_of_hidden_units(count: int) -> ColumnMirror:
    """The mirror of `count` hidden units: the first half of them swaps with the second half.

    If `count` is odd, the last unit stays.
    """
    half = count // 2
    source = np.r_[half : 2 * half, :half, 2 * half : count].astype(int)
    return ColumnMirror(source, np.ones(count), np.zeros(count))


def layer_mirrors(
    inputs: ColumnMirror, outputs: ColumnMirror, hidden: tuple[int, ...], half_cycle: int
) -> list[LayerMirror]:
    """The mirrors of all layers of a network, from the first to the last.

    inputs, outputs: mirrors of the network's inputs X and outputs Y. hidden: number of units of each hidden
    layer. half_cycle: see `LayerMirror`.
    """
    columns = [inputs, *map(mirror_of_hidden_units, hidden), outputs]
    return [LayerMirror(before, after, half_cycle) for before, after in pairwise(columns)]
