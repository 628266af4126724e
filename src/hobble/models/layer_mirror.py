"""What a layer of a network must be so that the network treats left and right alike."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from hobble.rows.mirror_columns import ColumnMirror


class LayerMirror(NamedTuple):
    """How a layer changes when its inputs and outputs are mirrored.

    The layer is (out, K, in + 1): K sets of weights, with the bias as the last column. inputs, outputs: the
    mirrors of what the layer reads and of what it computes. turn: half a cycle of the phase, counted in sets
    of weights; 0 if the weights do not depend on the phase.
    """

    inputs: ColumnMirror
    outputs: ColumnMirror
    turn: int


class LayerSymmetry:
    """Makes the parameters of a layer equal to those of its mirror image.

    A layer y = W x + b is symmetric if mirrored inputs, half a cycle later, give mirrored outputs. The mirror
    of a column may have a shift: x' = M x + d and y' = N y + e. M and N are permutations with signs, and each
    is its own inverse. The mirror image of (W, b) is (N W M, N (W d + b) + e), where W and b are
    those of half a cycle later. Mirroring twice gives the same layer, so the mean of a layer and its image is
    symmetric.
    """

    def __init__(self, layer: Tensor, mirror: LayerMirror) -> None:
        device = layer.device
        self.layer, self.turn = layer, mirror.turn
        self.inputs, self.outputs = (
            torch.from_numpy(columns.source).to(device) for columns in (mirror.inputs, mirror.outputs)
        )
        self.input_shift, self.output_shift = (
            torch.from_numpy(columns.shift).to(device, layer.dtype)
            for columns in (mirror.inputs, mirror.outputs)
        )
        signs = np.outer(mirror.outputs.sign, mirror.inputs.sign)
        self.weight_signs = torch.from_numpy(signs).to(device, layer.dtype)[:, None]
        self.bias_signs = torch.from_numpy(mirror.outputs.sign).to(device, layer.dtype)[:, None]

    def image(self) -> Tensor:
        """(out, K, in + 1), the mirror image of the layer."""
        turned = self.layer.roll(self.turn, 1)[self.outputs]
        weights, biases = turned[:, :, :-1], turned[:, :, -1]
        biases = self.bias_signs * (biases + weights @ self.input_shift) + self.output_shift[:, None]
        return torch.cat([weights[:, :, self.inputs] * self.weight_signs, biases[:, :, None]], dim=2)

    def enforce(self) -> None:
        """Replace the layer by the mean of itself and its mirror image."""
        self.layer.add_(self.image()).mul_(0.5)


def paired_units(count: int) -> ColumnMirror:
    """The mirror of hidden units: the first half swaps with the second. An odd last unit stays."""
    half = count // 2
    source = np.r_[half : 2 * half, :half, 2 * half : count].astype(int)
    return ColumnMirror(source, np.ones(count), np.zeros(count))


def layer_mirrors(
    inputs: ColumnMirror, outputs: ColumnMirror, hidden: tuple[int, ...], turn: int
) -> list[LayerMirror]:
    """The mirrors of consecutive layers.

    inputs, outputs: mirrors of X and Y. hidden: units of each hidden layer. turn: see `LayerMirror`.
    """
    columns = [inputs, *map(paired_units, hidden), outputs]
    return [LayerMirror(before, after, turn) for before, after in pairwise(columns)]
