"""The interface of networks of any kind that are ready to run, for the runtime, measurements and report."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from hobble.channels.speed_limits import Limits
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.training_facts import TrainingFacts
from hobble.rows.layout import GAITS, RowLayout

# The inputs include heights of the ground on the character's path and on both sides of it. The sides are at
# this distance (cm) from the path, unless the network's file gives another distance.
TERRAIN_SIDE = 25.0
STORAGES = ("float32", "int16")  # types in which a predictor can keep its weights

Export = Callable[[Path, str], str]  # see `Network.exports`


class Predictor(Protocol):
    """A network prepared for fast evaluation, called in every frame.

    It may keep buffers between calls, so each group of characters that is evaluated together needs its
    own predictor. It keeps no state of a character. If `Network.memory_size` is above 0, the caller keeps
    this state: an array (C, Network.memory_size) float64 for C characters, zero before a character's first
    frame.
    `evaluate` and `predict` then have one more argument `memory`, which the signatures below leave out. They
    change this array in place.

    X are the inputs and Y the outputs. In shapes, X and Y are the numbers of their columns.
    """

    @property
    def network(self) -> Network:
        """The network that the predictor evaluates."""

    def standardise(self, x: Array, z: Array) -> None:
        """Standardise the inputs x and write them into z, both (C, X) float32."""

    def evaluate(self, z: Array, phase: Array, out: Array) -> None:
        """Write Y (C, Y) float32 for standardised inputs z (C, X) at phases (C,), 0 to 1, into `out`."""

    def predict(self, x: Array, phase: Array, out: Array | None = None) -> Array:
        """Y (C, Y) float32 of X (C, X) float32 at phases (C,): `standardise`, then `evaluate`."""


@dataclass(frozen=True, kw_only=True)
class Network(ABC):
    """A network, and what the columns of its inputs X and outputs Y mean.

    x_mean, x_std (X,), y_mean, y_std (Y,): statistics to standardise X and restore Y.
    layout: which columns of X and Y hold what. skeleton: None if the file has none. gaits: names of the gaits
    in the order of their columns in X.
    channels: name of each input channel -> labels of its columns. limits: name of a channel -> speed limits.
    terrain_side: distance in cm from the path to the ground heights at its sides.
    meta: the metadata of the file. training_facts: ranges of the training data, None if the file has none.
    """

    kind: ClassVar[str] = ""  # name of its kind, and of the kind's folder in hobble.models
    uses_phase: ClassVar[bool] = True  # whether a prediction depends on the phase
    # Whether the predicted poses are recorded frames, as in motion matching. With other networks, the
    # runtime shortens the predicted movement of the root where the character should stand or go another way.
    # With recorded frames it does not, because the feet would slide.
    plays_recorded_poses: ClassVar[bool] = False
    # Names of the ways to evaluate the network, such as constant, linear and cubic interpolation over the
    # phase. The last one is exact.
    modes: ClassVar[tuple[str, ...]] = ("exact",)
    default_storage: ClassVar[str] = (
        "float32"  # how a predictor keeps its weights by default; one of STORAGES
    )

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
    training_facts: TrainingFacts | None = field(default=None, repr=False)

    def trained_labels(self, channel: str) -> tuple[str, ...]:
        """Labels of a channel's columns that were above 0 in some training row: their `x_mean` is above 0.

        All labels if all means are 0; () for a channel that the network does not have.
        """
        labels = self.channels.get(channel, ())
        means = self.x_mean[self.layout.x_channel(channel)] if labels else ()
        return tuple(label for label, mean in zip(labels, means, strict=True) if mean > 0) or labels

    @property
    def memory_size(self) -> int:
        """How many numbers the caller keeps for each character between frames; see `Predictor`."""
        return 0

    @classmethod
    def resolve_mode(cls, wanted: str | None) -> str:
        """The mode to run: `wanted`, or the exact one by default.

        A network with only one mode accepts any name. Raises ValueError for an unknown mode.
        """
        if wanted is None or len(cls.modes) == 1:
            return cls.modes[-1]
        if wanted not in cls.modes:
            raise ValueError(f"mode {wanted!r}: not one of {', '.join(cls.modes)}")
        return wanted

    @property
    @abstractmethod
    def sizes(self) -> tuple[int, ...]:
        """Units of each layer, the input first, such as (342, 512, 512, 311); () without layers."""

    @property
    @abstractmethod
    def parameter_count(self) -> int:
        """How many weights and biases the network has at one phase, or numbers in its tables."""

    def stored_numbers(self, mode: str) -> int:
        """How many numbers the network keeps in memory to run in `mode`, one of `modes`."""
        return self.parameter_count

    @property
    @abstractmethod
    def description(self) -> str:
        """What the network is, in words that can follow "A" in a sentence."""

    @abstractmethod
    def predict(self, x: Array, phase: Array) -> Array:
        """Y (n, Y) float32 of X (n, X) at phases (n,) in 0..1, in raw units. Plain numpy, as a reference."""

    @abstractmethod
    def predictor(self, mode: str | None = None, storage: str | None = None) -> Predictor:
        """The network prepared for fast evaluation.

        mode: one of `modes`, by default the exact one. storage: one of STORAGES, by default the kind's own.
        Raises ValueError for an unknown mode or storage.
        """

    @abstractmethod
    def page_data(self, inputs: NDArray[np.int64], outputs: NDArray[np.int64]) -> dict[str, Any]:
        """Data for JSON, with which the report's page evaluates the network in a browser.

        `network.js` in the kind's folder reads the data. The page predicts only the columns `outputs` of Y
        from the columns `inputs` of X. The weights of other columns are left out.
        """

    @property
    def exports(self) -> dict[str, Export]:
        """Name of each export format -> a function that writes the file or folder `target` for a mode.

        The function has the arguments (target, mode) and returns a message for the user.
        """
        return {}

    def export(self, to: str, target: str | Path, mode: str) -> str:
        """Write the network in the format `to`, and return a message for the user.

        Raises HobbleError if the network does not have this format.
        """
        if to not in self.exports:
            known = ", ".join(self.exports) or "none"
            raise HobbleError(f"a {self.kind} network cannot be written as {to}; formats: {known}")
        return self.exports[to](Path(target), mode)


def standardise_inputs(network: Network, x: Array) -> Array:
    """Inputs x (n, X) standardised: (x - mean) / std in float32, and 0 for a column that never varied."""
    std = np.where(network.x_std > 0, network.x_std, np.float32(np.inf))
    return (np.asarray(x, np.float32) - network.x_mean) / std


def inverse_or_0(std: Array) -> Array:
    """1 / std, and 0 for a column that never varied, to avoid a division by 0."""
    return np.where(std > 0, 1 / np.maximum(std, 1e-30), 0)
