"""A feed-forward network that gets the phase as input. It is the baseline for the kind `pfnn`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from hobble.core.quat import Array
from hobble.models.blend import BlendedNetwork, BlendedOptions, TrainableBlend
from hobble.rows.layout import ColumnMirror

if TYPE_CHECKING:
    from torch import Tensor

    from hobble.models.onnx_file import Graph, Node
    from hobble.models.predict import Shares

PHASE_INPUTS = 2  # sine and cosine of the phase, after the columns of X


class PlainOptions(BlendedOptions):
    """A feed-forward network. By default its layers have the sizes of the phase-functioned network's."""

    network: ClassVar[str] = "hobble.models.plain:Plain"

    kind: Literal["plain"] = "plain"

    @property
    def why_not_symmetric(self) -> str:
        """As in `Options`: always "", because any plain network can be trained with `training.symmetric`."""
        return ""

    def trainable(self, flat: Any, sizes: tuple[int, ...], columns: tuple[int, ...]) -> TrainablePlain:
        """As in `BlendedOptions`."""
        return TrainablePlain(flat, sizes, 1, kind=self.kind)


OPTIONS = PlainOptions


@dataclass(frozen=True)
class Plain(BlendedNetwork):
    """A feed-forward network. Its first layer gets X, then sine and cosine of the phase."""

    kind: ClassVar[str] = "plain"
    description: ClassVar[str] = "feed-forward network that gets the phase"
    extra_inputs: ClassVar[int] = PHASE_INPUTS

    def shares(self, z: Array, phase: Array) -> Array:
        """As in `BlendedNetwork`: 1 for the only set."""
        return np.ones((len(z), 1), np.float32)

    def extended(self, z: Array, phase: Array) -> Array:
        """As in `BlendedNetwork`."""
        angle = 2 * np.pi * np.asarray(phase, float)
        extended = np.empty((len(z), z.shape[1] + PHASE_INPUTS), np.float32)
        extended[:, :-2], extended[:, -2], extended[:, -1] = z, np.sin(angle), np.cos(angle)
        return extended

    def prepare(self, mode: str) -> tuple[tuple[Array, ...], tuple[Array, ...], Shares]:
        """As in `BlendedNetwork`."""
        return self.weights, self.biases, self.shares

    def onnx_shares(self, g: Graph, z: Node, mode: str) -> tuple[None, None]:
        """As in `BlendedNetwork`."""
        return None, None

    def onnx_extended(self, g: Graph, z: Node) -> Node:
        """As in `BlendedNetwork`."""
        angle = g("Unsqueeze", g.named("phase") * (2 * np.pi), [1])
        return g("Concat", z, g("Sin", angle), g("Cos", angle), axis=1)


@dataclass(frozen=True)
class TrainablePlain(TrainableBlend):
    """A plain network in training."""

    extra_inputs: ClassVar[int] = PHASE_INPUTS

    def shares(self, gate: list[Tensor], x: Tensor, p: Tensor, masks: list[Tensor] | None) -> Tensor:
        """As in `TrainableBlend`: 1 for the only set."""
        return p.new_ones(len(p), 1)

    def extended(self, x: Tensor, p: Tensor) -> Tensor:
        """As in `TrainableBlend`."""
        import torch

        angle = 2 * torch.pi * p[:, None]
        return torch.cat([x, torch.sin(angle), torch.cos(angle)], dim=1)

    def mirror_of_inputs(self, inputs: ColumnMirror) -> ColumnMirror:
        """As in `TrainableBlend`. Half a cycle later, sine and cosine of the phase have the opposite sign."""
        return ColumnMirror(
            np.append(inputs.source, len(inputs.source) + np.arange(PHASE_INPUTS)),
            np.append(inputs.sign, -np.ones(PHASE_INPUTS)),
            np.append(inputs.shift, np.zeros(PHASE_INPUTS)),
        )

    def arrays(self) -> dict[str, np.ndarray]:
        """As in `TrainableBlend`: `W0` (out, in), `b0` (out,), `W1`, `b1`, ..."""
        return {name: array[0] for name, array in super().arrays().items()}
