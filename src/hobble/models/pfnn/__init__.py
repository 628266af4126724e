"""The phase-functioned network (Holden, Komura, Saito 2017); `hobble.models.forward` explains it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hobble.core.quat import Array
from hobble.core.section import PhaseMode
from hobble.models.blend import BlendedNetwork, BlendedOptions, TrainableBlend
from hobble.models.forward import catmull_rom, phase_shares, weights_at
from hobble.models.network import PHASED
from hobble.models.pfnn.release import read_release, write_release

if TYPE_CHECKING:
    from torch import Tensor

    from hobble.models.onnx_file import Graph, Node
    from hobble.models.predict import Shares

# How a network is run in a mode: number of stored phases (None: the control points are stored), and how many
# of the stored sets of weights are blended.
STORED_AND_BLENDED = {"constant": (50, 1), "linear": (10, 2), "cubic": (None, 4)}


class PfnnOptions(BlendedOptions):
    """The phase-functioned network, by default as large as the weights released by Holden et al. (2017).

    control_points: number of weight sets, evenly spaced over a cycle, between which the phase interpolates.
    """

    modes: ClassVar[tuple[str, ...]] = get_args(PhaseMode)

    network: ClassVar[str] = "hobble.models.pfnn:Pfnn"

    kind: Literal["pfnn"] = "pfnn"
    control_points: Annotated[int, Field(ge=4, le=16)] = 4

    @property
    def why_not_symmetric(self) -> str:
        """As in `Options`. Each control point needs a partner half a cycle later."""
        why = f"it needs an even number of network.control_points, not {self.control_points}"
        return why if self.control_points % 2 else ""

    def trainable(self, flat: Any, sizes: tuple[int, ...], columns: tuple[int, ...]) -> TrainablePfnn:
        """As in `BlendedOptions`."""
        return TrainablePfnn(flat, sizes, self.control_points, kind=self.kind)


OPTIONS = PfnnOptions


@dataclass(frozen=True)
class Pfnn(BlendedNetwork):
    """Layers whose weights and biases are cyclic cubic splines of the phase, with K control points.

    There are three modes: "constant" (50 phases; the phase is rounded down to one), "linear" (10 phases; two
    are blended) and "cubic" (control points, exact).
    """

    kind: ClassVar[str] = "pfnn"
    description: ClassVar[str] = "phase-functioned network"
    modes: ClassVar[tuple[str, ...]] = PfnnOptions.modes
    set_word: ClassVar[str] = "control points"
    set_range: ClassVar[tuple[int, int]] = (4, 64)  # a cyclic cubic spline needs four

    @classmethod
    def read_folder(cls, folder: Path) -> Mapping[str, np.ndarray] | None:
        """As in `Network`: the .bin files of Holden et al. (2017)."""
        return read_release(folder) if any(folder.glob("*.bin")) else None

    def stored_numbers(self, mode: str) -> int:
        """As in `Network`: weights and biases at each of the mode's phases, or of each control point."""
        return (STORED_AND_BLENDED[mode][0] or self.sets) * self.parameter_count

    def shares(self, z: Array, phase: Array) -> Array:
        """As in `BlendedNetwork`."""
        return phase_shares(np.asarray(phase, float), np.arange(self.sets)).astype(np.float32)

    def prepare(self, mode: str) -> tuple[tuple[Array, ...], tuple[Array, ...], Shares]:
        """As in `BlendedNetwork`. Raises ValueError for an unknown mode."""
        from hobble.models.predict import shares_at

        stored, blended = STORED_AND_BLENDED[self.resolve_mode(mode)]
        if stored is None:
            return self.weights, self.biases, partial(shares_at, blended, self.sets)
        phases = np.arange(stored) / stored
        weights, biases = (
            tuple(weights_at(points, phases) for points in layers) for layers in (self.weights, self.biases)
        )
        return weights, biases, partial(shares_at, blended, stored)

    def engine_data(
        self, mode: str, storage: str, inputs: NDArray[np.int64]
    ) -> tuple[dict[str, int], dict[str, np.ndarray]]:
        """As in `Network`."""
        sizes, sections = super().engine_data(mode, storage, inputs)
        return sizes | {"form": PHASED, "blended": STORED_AND_BLENDED[mode][1]}, sections

    def onnx_shares(self, g: Graph, z: Node, mode: str) -> tuple[Node | None, Node]:
        """As in `BlendedNetwork`."""
        stored, blended = STORED_AND_BLENDED[mode]
        points, phase = stored or self.sets, g.named("phase")
        # A phase of exactly 1 is the end of the cycle, not its start, as in `write_phase_shares`. Other
        # phases are brought to 0..1.
        wrapped = g("Where", g("Equal", phase, 1.0), phase, phase - g("Floor", phase))
        scaled = g("Unsqueeze", wrapped * float(points), [1])
        first = g("Min", g("Floor", scaled), points - 1.0)
        t = scaled - first
        shares = {1: (t * 0.0 + 1.0,), 2: (1.0 - t, t), 4: catmull_rom(t)}[blended]
        share = g("Concat", *shares, axis=1)
        # Numbers of the blended points. `points` is added because the remainder of a negative number is
        # negative.
        before = 1 if blended == 4 else 0
        index = g(
            "Mod", g("Cast", first, to=7) + (np.arange(blended) + points - before), [points]
        )  # 7 is int64
        if stored:
            return index, share
        # All control points are blended: the shares are moved to their places among zeros.
        at = g("Cast", g("Equal", g("Unsqueeze", index, [2]), np.arange(points)), to=1)  # 1 is float32
        return None, g("ReduceSum", at * g("Unsqueeze", share, [2]), [1], keepdims=0)

    def export_bin(self, target: Path, mode: str) -> str:
        """As `Network.export`: the .bin files of Holden et al. (2017), with the weights of mode constant."""
        write_release(target, self)
        return f"{target}: weights at 50 phases"


@dataclass(frozen=True)
class TrainablePfnn(TrainableBlend):
    """A phase-functioned network in training."""

    def shares(self, gate: list[Tensor], x: Tensor, p: Tensor, masks: list[Tensor] | None) -> Tensor:
        """As in `TrainableBlend`."""
        import torch

        from hobble.models.predict import write_phase_shares

        if p.device.type != "cpu":
            return phase_shares(p, torch.arange(self.sets, device=p.device))
        shares = p.new_zeros(len(p), self.sets)
        write_phase_shares(4, p.numpy(), shares.numpy())
        return shares
