"""What every trained network is to those who run, measure and show it, whatever stands inside."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from hobble.channels.limits import Limits
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.seen import Seen
from hobble.rows.layout import GAITS, RowLayout

TERRAIN_SIDE = 25.0  # centimetres from the path to the side heights, where a file does not tell
STORAGES = ("float32", "int16")

Export = Callable[[Path, str], str]


class Predictor(Protocol):
    """A network prepared to run: what a character asks in every frame.

    network: what it was made of. One predictor serves one crowd: it may keep buffers between calls. What it
    has to know of each character is not kept here but in the character: where `Network.memory` is above 0,
    `evaluate` and `predict` take a last argument, `memory`, (C, Network.memory) float64. It is changed in
    place, and zeros before a character's first frame.
    """

    @property
    def network(self) -> Network:
        """What it was made of."""

    def standardise(self, x: Array, z: Array) -> None:
        """z = the inputs x as the network wants them, both (C, X) float32."""

    def evaluate(self, z: Array, phase: Array, out: Array) -> None:
        """Write Y (C, Y) float32 of standardised inputs z (C, X) at phases (C,) in cycles into `out`."""

    def predict(self, x: Array, phase: Array, out: Array | None = None) -> Array:
        """Y (C, Y) float32 of X (C, X) float32 at phases (C,): the two above in one."""


@dataclass(frozen=True, kw_only=True)
class Network(ABC):
    """A network with the columns it reads and writes.

    x_mean, x_std, y_mean, y_std: what standardises X and restores Y.
    layout: the columns; gaits: the order of the gait blocks; skeleton: None where the file carries none.
    channels: name -> labels of its columns, of each channel that it is told. terrain_side: centimetres from
    the path to the heights at its sides. limits: channel -> how fast it lets the body go.
    meta: what else the file says. seen: what training showed it, None where the file does not tell.
    """

    kind: ClassVar[str] = ""  # its folder in hobble.models
    phase: ClassVar[bool] = True  # whether a prediction depends on the phase that it is given
    rooted: ClassVar[bool] = (
        False  # whether its movement of the root belongs to its pose, and is never held back
    )
    modes: ClassVar[tuple[str, ...]] = ("exact",)  # of the predictor; the last one is exact

    x_mean: Array = field(repr=False)
    x_std: Array = field(repr=False)
    y_mean: Array = field(repr=False)
    y_std: Array = field(repr=False)
    layout: RowLayout
    skeleton: Skeleton | None = field(default=None, repr=False)
    gaits: tuple[str, ...] = GAITS
    channels: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    terrain_side: float = TERRAIN_SIDE
    limits: Mapping[str, Limits] = field(default_factory=dict, repr=False)
    meta: Mapping[str, Any] = field(default_factory=dict, repr=False)
    seen: Seen | None = field(default=None, repr=False)

    def trained(self, channel: str) -> tuple[str, ...]:
        """Labels of a channel's columns that told something in training, as the means of their inputs say.

        All where none says so; () for a channel that the network is not told.
        """
        labels = self.channels.get(channel, ())
        means = self.x_mean[self.layout.x_channel(channel)] if labels else ()
        return tuple(label for label, mean in zip(labels, means, strict=True) if mean > 0) or labels

    @property
    def memory(self) -> int:
        """Numbers that a character keeps for it between frames; see `Predictor`."""
        return 0

    @classmethod
    def mode(cls, wanted: str | None) -> str:
        """Which of `modes` runs where `wanted` is asked for: the exact one by default.

        A network of one mode looks no phase up, so that any is right. Raises ValueError for an unknown one.
        """
        if wanted is None or len(cls.modes) == 1:
            return cls.modes[-1]
        if wanted not in cls.modes:
            raise ValueError(f"mode {wanted!r}: not one of {', '.join(cls.modes)}")
        return wanted

    @property
    @abstractmethod
    def sizes(self) -> tuple[int, ...]:
        """Units of each layer, the input first: (342, 512, 512, 311); () where there are no layers."""

    @property
    @abstractmethod
    def parameters(self) -> int:
        """Numbers that one prediction goes through: the weights and biases of one phase."""

    def stored(self, mode: str) -> int:
        """Numbers that it keeps in memory to run in a mode, one of `modes`."""
        return self.parameters

    @property
    @abstractmethod
    def described(self) -> str:
        """What it is, for a sentence that begins with "A"."""

    @abstractmethod
    def predict(self, x: Array, phase: Array) -> Array:
        """Y (n, Y) float32 of X (n, X) at phases (n,) in 0..1, all in raw units, in plain numpy."""

    @abstractmethod
    def predictor(self, mode: str | None = None, storage: str = "float32") -> Predictor:
        """Prepare it to run.

        mode: one of `modes`, by default the exact one. storage: one of STORAGES. Raises ValueError for
        another mode or storage.
        """

    @abstractmethod
    def page(self, inputs: NDArray[np.int64], outputs: NDArray[np.int64]) -> dict[str, Any]:
        """What `network.js` of its folder needs, as JSON, to predict the columns `outputs` of Y from the
        columns `inputs` of X; the others weigh nothing."""

    @property
    def exports(self) -> dict[str, Export]:
        """Formats of other programs: name -> write(target, mode), which returns what to tell the user."""
        return {}

    def export(self, to: str, target: str | Path, mode: str) -> str:
        """Write the network as `to`; raises HobbleError where it has no such format."""
        if to not in self.exports:
            there = ", ".join(self.exports) or "none"
            raise HobbleError(f"a {self.kind} network cannot be written as {to}; formats: {there}")
        return self.exports[to](Path(target), mode)


def standardised(network: Network, x: Array) -> Array:
    """(x - mean) / std in float32, and 0 for a column that never varied."""
    std = np.where(network.x_std > 0, network.x_std, np.float32(np.inf))
    return (np.asarray(x, np.float32) - network.x_mean) / std


def inverse(std: Array) -> Array:
    """1 / std, and 0 for a column that never varied: it tells nothing and must not blow up."""
    return np.where(std > 0, 1 / np.maximum(std, 1e-30), 0)
