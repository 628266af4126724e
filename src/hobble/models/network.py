"""The interface of networks of any kind that are ready to run, for the runtime, measurements and report.

Also facts about the training data, which a network carries with it, and the packing of arrays for the page.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from hobble.channels import channel
from hobble.channels.speed_limits import Limits
from hobble.core.errors import HobbleError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.rows.layout import GAITS, RowLayout, compose

# The inputs include heights of the ground on the character's path and on both sides of it. The sides are at
# this distance (cm) from the path, unless the network's file gives another distance.
TERRAIN_SIDE = 25.0
STORAGES = ("float32", "int16")  # types in which a predictor can keep its weights

# Where the runtime in C gets a prediction from: sets of weights blended around the phase, one set of weights,
# sets that a gate blends, or recorded frames.
PHASED, FIXED, GATED, RECORDED, LEARNED = range(5)


# Name in the network's file -> field of `TrainingFacts`, for the fields with a number for each column.
FACTS = {
    "Xlow": "x_low",
    "Xhigh": "x_high",
    "Ylow": "y_low",
    "Yhigh": "y_high",
    "start_x": "start_x",
    "start_y": "start_y",
}
MOVES = 1e9  # added to a squared distance; larger than the squared distance of any row
STANDING_GAIT = 0.99  # a row with at least this share of the gait "stand" counts as standing
# If the mean of the gait "stand" over all rows is higher than this, a character starts from a standing row.
# Otherwise it starts from the row nearest to the mean of all rows.
MIN_STANDING_SHARE = 0.005


@dataclass(frozen=True)
class TrainingFacts:
    """Facts about the training rows, in raw units; the arrays are float32.

    x_low, x_high (X,), y_low, y_high (Y,): smallest and largest value of each column. start_x (X,), start_y
    (Y,), start_phase: the row from which a character starts. It is the standing row with the least movement,
    or the row nearest to the mean if standing is rare. fastest: largest speed of any joint in any row, cm a
    frame.
    """

    x_low: Array = field(repr=False)
    x_high: Array = field(repr=False)
    y_low: Array = field(repr=False)
    y_high: Array = field(repr=False)
    start_x: Array = field(repr=False)
    start_y: Array = field(repr=False)
    start_phase: float
    fastest: float

    def arrays(self) -> dict[str, Array]:
        """Name -> array, for the network's file."""
        columns = {name: getattr(self, key) for name, key in FACTS.items()}
        return {**columns, "start_phase": np.float64(self.start_phase), "fastest": np.float64(self.fastest)}

    @classmethod
    def from_rows(cls, layout: RowLayout, parts: Iterable[Any], statistics: Any) -> TrainingFacts:
        """The facts about all rows.

        parts: the rows, in blocks (`UncomposedRows` in `hobble.database.reader`). statistics: means and
        standard deviations of their columns (x_mean, x_std, y_mean, y_std).

        A row is stored without ground, and with several fits: terrains that can lie under it. Only the ground
        and the heights of joints above it depend on the fit. So for the ranges, a row is composed only with
        its extreme fits, the lowest and the highest in each column. The start row is composed with its first
        fit.
        """
        # The column of the gait "stand" at the middle of the trajectory, which is the present frame.
        stand = layout.x_gait.start + GAITS.index("stand") * layout.samples + layout.samples // 2
        often_stands = statistics.x_mean[stand] > MIN_STANDING_SHARE
        body = np.r_[layout.x_position, layout.x_direction, layout.x_joint_position, layout.x_joint_velocity]
        low, high = (np.inf, np.inf), (-np.inf, -np.inf)
        nearest, start, fastest = np.inf, None, 0.0
        for part in parts:
            least, most = (f.reduceat(part.fits, part.first_fit, axis=0) for f in (np.minimum, np.maximum))
            # The last column of a fit, its lift, is subtracted from the heights of joints. So the heights are
            # lowest with the highest lift.
            rows = _raw(layout, part, least[:, :-1], most[:, -1:], statistics)
            low = tuple(np.minimum(a, values.min(axis=0)) for a, values in zip(low, rows, strict=True))
            rows = _raw(layout, part, most[:, :-1], least[:, -1:], statistics)
            high = tuple(np.maximum(a, values.max(axis=0)) for a, values in zip(high, rows, strict=True))
            first_fit = part.fits[part.first_fit]
            x, y = _raw(layout, part, first_fit[:, :-1], first_fit[:, -1:], statistics)
            speed = np.linalg.norm(y[:, layout.y_joint_velocity].reshape(len(y), -1, 3), axis=-1)
            fastest = max(fastest, float(speed.max()))
            # `distance`: how far each row is from the ideal start row.
            if often_stands:  # ideal: no movement, neither of the root along its path nor of any joint
                along_path = np.square(x[:, layout.x_position]).sum(axis=1, dtype=float)
                distance = along_path + np.square(speed).sum(axis=1, dtype=float)
                # A row that does not stand is taken only if no row stands.
                distance = np.where(x[:, stand] >= STANDING_GAIT, distance, distance + MOVES)
            else:  # ideal: the mean of all rows
                mean, std = statistics.x_mean[body], statistics.x_std[body]
                distance = np.square((x[:, body] - mean) / std).mean(axis=1)
            row = int(distance.argmin())
            if start is None or distance[row] < nearest:
                nearest, start = float(distance[row]), (x[row], y[row], float(part.p[row]))
        assert start is not None, "a database has rows"
        arrays = (low[0], high[0], low[1], high[1], *start[:2])
        values: Any = [*(np.asarray(array, np.float32) for array in arrays), start[2], fastest]
        return cls(*values)


def _raw(layout: RowLayout, part: Any, ground: Array, lift: Array, statistics: Any) -> tuple[Array, Array]:
    """x (n, X) and y (n, Y) in raw units, with a terrain under each row.

    part: n rows. ground: (n, m) heights of the terrain. lift: (n, 1) cm by which the joints are lowered.
    statistics: means and standard deviations of the columns.
    """
    x, y = np.empty((len(part.x), layout.x_size), np.float32), part.y.copy()
    s = statistics
    compose(layout, part.x, ground, lift, x, y, s.x_std, s.y_std)
    return x * s.x_std + s.x_mean, y * s.y_std + s.y_mean


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
    description: ClassVar[str] = ""  # what the network is, in words that can follow "A" in a sentence
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
    def channel_curves(self) -> tuple[Array, Array]:
        """The arguments `highest` and `exponent` (K,) of `read_through_curve` for the K columns of channels.

        A file without exponents has the exponent 1.
        """
        names = [name for name, columns in self.layout.channels for _ in range(columns)]
        exponents = self.meta.get("exponents", {})
        highest = np.array([channel(name).highest for name in names], float)
        return highest, np.array([exponents.get(name, 1.0) for name in names], float)

    @property
    def memory_size(self) -> int:
        """How many numbers the caller keeps for each character between frames; see `Predictor`."""
        return 0

    def memory_of(self, x: Array) -> Array:
        """(n, memory_size): what the caller keeps of characters that go on from captured inputs x (n, X)."""
        return np.zeros((len(x), self.memory_size))

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

    @classmethod
    @abstractmethod
    def read(cls, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Self:
        """The network of a file.

        path: the file, for error messages. arrays: those of the file, by name, as `FinishedNetwork.arrays`
        returned them. shared_fields: the fields of `Network`, by name, already checked. Raises InputError for
        arrays that make no network; `hobble.models.load` has functions for these checks.
        """

    @classmethod
    def read_folder(cls, folder: Path) -> Mapping[str, Array] | None:
        """The arrays of a folder in another program's format; None if it holds no network of this kind."""
        return None

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

    @abstractmethod
    def predict(self, x: Array, phase: Array) -> Array:
        """Y (n, Y) float32 of X (n, X) at phases (n,) in 0..1, in raw units. Plain numpy, as a reference."""

    def predictor(self, mode: str | None = None, storage: str | None = None) -> Predictor:
        """The network prepared for fast evaluation.

        mode: one of `modes`, by default the exact one. storage: one of STORAGES, by default the kind's own.
        Raises ValueError for an unknown mode or storage.
        """
        storage = storage or self.default_storage
        if storage not in STORAGES:
            raise ValueError(f"storage {storage!r}: not one of {', '.join(STORAGES)}")
        return self.prepared(self.resolve_mode(mode), storage)

    @abstractmethod
    def prepared(self, mode: str, storage: str) -> Predictor:
        """As `predictor`, with arguments that are known to be right."""

    @abstractmethod
    def engine_data(
        self, mode: str, storage: str, inputs: NDArray[np.int64]
    ) -> tuple[dict[str, int], dict[str, np.ndarray]]:
        """The network in a character file (`hobble.engine.hob`): entries of its section "sizes"; sections.

        mode: one of `modes`. storage: one of STORAGES. inputs: the columns of X to read; others have no
        effect.

        The entries are form (PHASED, FIXED, GATED, RECORDED or LEARNED), layers, sets, and extra, which is 2
        if the first layer gets sine and cosine of the phase after X; for PHASED blended, how many sets blend;
        for GATED gate_layers and gate_inputs; for RECORDED only form, rows, features and every; for LEARNED
        features, every, latent, stepper_layers and projector_layers.
        `Stack.sections` makes the sections of layers.
        """

    def copy_for_page(self) -> Self:
        """A copy that is small enough to be in a report's page; by default the network itself."""
        return self

    def export(self, to: str, target: str | Path, mode: str) -> str:
        """Write the file or folder `target` in the format `to`, by the method `export_<to>` of the kind.

        mode: one of `modes`. Returns a message for the user. Raises HobbleError if the kind lacks the format.
        """
        writer: Callable[[Path, str], str] | None = getattr(self, f"export_{to}", None)
        if writer is None:
            raise HobbleError(f"a {self.kind} network cannot be written as {to}")
        return writer(Path(target), mode)


class Predictor(ABC):
    """A network prepared for fast evaluation, called in every frame.

    It may keep buffers between calls, so each group of characters that is evaluated together needs its
    own predictor. It keeps no state of a character. If `Network.memory_size` is above 0, the caller keeps
    this state: an array (C, Network.memory_size) float64 for C characters, zero before a character's first
    frame. It is the argument `memory`, and changed in place.

    X are the inputs and Y the outputs. In shapes, X and Y are the numbers of their columns.
    """

    def __init__(self, network: Network) -> None:
        self.network = network
        self._x_mean, self._x_inverse = (
            np.ascontiguousarray(a, np.float32) for a in (network.x_mean, inverse_or_0(network.x_std))
        )

    def standardise(self, x: Array, z: Array) -> None:
        """Standardise the inputs x and write them into z, both (C, X) float32."""
        np.subtract(x, self._x_mean, out=z)
        z *= self._x_inverse

    @abstractmethod
    def evaluate(self, z: Array, phase: Array, out: Array, memory: Array | None = None) -> None:
        """Write Y (C, Y) float32 for standardised inputs z (C, X) at phases (C,), 0 to 1, into `out`."""

    def predict(self, x: Array, phase: Array, out: Array | None = None, memory: Array | None = None) -> Array:
        """Y (C, Y) float32 of X (C, X) float32 at phases (C,): `standardise`, then `evaluate`."""
        z = np.empty_like(x)
        self.standardise(x, z)
        if out is None:
            out = np.empty((len(x), len(self.network.y_mean)), np.float32)
        self.evaluate(z, phase, out, memory)
        return out


def standardise_inputs(network: Network, x: Array) -> Array:
    """Inputs x (n, X) standardised: (x - mean) / std in float32, and 0 for a column that never varied."""
    std = np.where(network.x_std > 0, network.x_std, np.float32(np.inf))
    return (np.asarray(x, np.float32) - network.x_mean) / std


def inverse_or_0(std: Array) -> Array:
    """1 / std, and 0 for a column that never varied, to avoid a division by 0."""
    return np.where(std > 0, 1 / np.maximum(std, 1e-30), 0)
