"""Motion matching with the interface of a network: it plays recorded frames, which a search chooses.

Inertialisation makes the transitions smooth. Motion matching plays frames of clips. Their rows are in a table
with one row for each frame, in runs of consecutive frames. At a transition, playback jumps to another row.
The differences in pose and velocity are stored as offsets and added to the following poses. So no joint
jumps. The offsets decay like a critically damped spring (Bollo, Inertialization, GDC 2018; closed form after
Holden, Spring-It-On, 2021). A cross-fade would need two poses of the clips in each frame; this needs one.

A rotation is a vector: its axis times half its angle, as in the network's output Y. Positions are in root
coordinates, in cm; speeds are per frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial import cKDTree

from hobble.core import quat
from hobble.core.declared import ArrayOf, read_declared
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.models.load import LARGEST_MEAN, read_arrays
from hobble.models.matching.build import findable_rows
from hobble.models.network import RECORDED, Network, Predictor, standardise_inputs
from hobble.rows.layout import RowLayout

# Largest number of rows of the tables. The page keeps row numbers in float32, which is exact up to here.
MOST_ROWS = 1 << 24
MOST_WEIGHT = 1e9  # largest weight of a feature
MOST_FRAMES = 1_000_000  # largest number of frames between two searches, and largest half-life in frames
# About this many rows are put in the report's page, as 5.5 MB of text. A page with several characters should
# stay below 20 MB.
MOST_ON_PAGE = 5500
# If a search finds a row at most this many rows from the row that follows in the run, there is no transition
# (Holden et al. 2020).
SURROUNDING = 20
# Indices in the memory of a character, an array of numbers that is 0 before its first frame.
ROW = 0  # 1 + the last row shown; 0 before the first frame
SINCE = 1  # frames since the last search
OFFSETS = 2  # the first of the offsets
# A joint has offsets of position, velocity, rotation and rotation speed, in this order, three numbers each.
OFFSETS_PER_JOINT = 12
FASTEST_PULL = 0.002  # cycles per frame: the phase is corrected toward the clip's phase by at most this


@dataclass(frozen=True)
class Playing:
    """The entries of `meta` for motion matching; see `Matching`."""

    every: Annotated[int, Field(strict=True, ge=1, le=MOST_FRAMES)]
    halflife: Annotated[float, Field(strict=True, gt=0, le=MOST_FRAMES)]


@dataclass(frozen=True)
class Matching(Network):
    """Motion matching over R frames of clips, in runs of consecutive frames.

    columns: (n,) the columns of X that a search compares, called features. feature_weights: (n,) their
    factors. features: (R, n) float32, these columns of each frame, times their factors. frames: (R, Y)
    float32, the Y of each frame, in raw units. phase: (R,) float32, in cycles. remaining: (R,) how many
    frames follow each frame in its run. every: frames between two searches. halflife: of the offsets that
    smooth a transition to another frame, in frames (see `Transitions`).
    """

    kind: ClassVar[str] = "matching"
    description: ClassVar[str] = "motion matching"
    uses_phase: ClassVar[bool] = False
    plays_recorded_poses: ClassVar[bool] = True

    features: Array = field(repr=False)
    frames: Array = field(repr=False)
    phase: Array = field(repr=False)
    remaining: NDArray[np.int64] = field(repr=False)
    columns: NDArray[np.int64] = field(repr=False)
    feature_weights: Array = field(repr=False)
    every: int
    halflife: float

    @classmethod
    def read(cls, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Matching:
        """As in `Network`. arrays: those of `hobble.models.matching.build.read_tables`."""
        inputs, outputs = len(shared_fields["x_mean"]), len(shared_fields["y_mean"])
        declared = {
            "frames": ArrayOf(("frames", outputs), "fiu", -LARGEST_MEAN, LARGEST_MEAN),
            "features": ArrayOf(("frames", "features"), "fiu", -LARGEST_MEAN, LARGEST_MEAN),
            "phase": ArrayOf(("frames",), "fiu", -1, 1),
            "feature_weights": ArrayOf(("features",), "fiu", 0, MOST_WEIGHT),
            "columns": ArrayOf(("features",), "iu", 0, inputs - 1),
            "remaining": ArrayOf(("frames",), "iu", 0, MOST_ROWS),
        }
        found, lengths = read_arrays(path, arrays, declared)
        remaining = found["remaining"]
        if lengths["frames"] > MOST_ROWS:
            raise InputError(path, f"{lengths['frames']} frames; at most {MOST_ROWS} are allowed")
        # With this check, a character that plays a run never gets beyond the end of the table.
        if (
            remaining[-1] != 0
            or (remaining[:-1][remaining[:-1] > 0] != remaining[1:][remaining[:-1] > 0] + 1).any()
        ):
            raise InputError(path, "remaining has to count down by 1 a row, to 0 at the end of each run")
        if shared_fields["skeleton"] is None:
            raise InputError(path, "motion matching needs a skeleton, but the meta of the file has none")
        playing = read_declared(path, "meta", Playing, shared_fields["meta"])
        return cls(**found, every=playing.every, halflife=playing.halflife, **shared_fields)

    def copy_for_page(self, most: int = MOST_ON_PAGE) -> Matching:
        """As in `Network`: only the first part of each run, so that about `most` rows remain in all."""
        first_rows = np.flatnonzero(np.r_[True, self.remaining[:-1] == 0])
        lengths = self.remaining[first_rows] + 1
        new_lengths = np.ceil(lengths * min(1.0, most / len(self.remaining))).astype(np.int64)
        place_in_run = np.arange(len(self.remaining)) - np.repeat(first_rows, lengths)
        remaining = np.repeat(new_lengths, lengths) - 1 - place_in_run
        kept = remaining >= 0
        shortened = {name: getattr(self, name)[kept] for name in ("features", "frames", "phase")}
        return replace(self, remaining=remaining[kept], **shortened)

    @cached_property
    def start_rows(self) -> NDArray[np.int64]:
        """As `findable_rows`."""
        return findable_rows(self.remaining)

    @cached_property
    def tree(self) -> cKDTree:
        """A k-d tree of the features of the rows `start_rows`."""
        return cKDTree(self.features[self.start_rows])

    @property
    def memory_size(self) -> int:
        """As in `Network`: the row shown, the number of frames since the last search, and the offsets."""
        return OFFSETS + OFFSETS_PER_JOINT * self.layout.joints

    @property
    def sizes(self) -> tuple[int, ...]:
        """As in `Network`: there are no layers."""
        return ()

    @property
    def parameter_count(self) -> int:
        """How many numbers the tables `frames` and `features` hold."""
        return self.frames.size + self.features.size

    def input_features(self, z: Array) -> Array:
        """The weighted features (C, n) float32 of C characters, from their standardised inputs z (C, X)."""
        raw = z[:, self.columns] * self.x_std[self.columns] + self.x_mean[self.columns]
        return np.ascontiguousarray(raw * self.feature_weights, np.float32)

    def nearest_rows(self, queries: Array) -> NDArray[np.int64]:
        """The rows (C,) among `start_rows` whose features are nearest to the features `queries` (C, n)."""
        return self.start_rows[self.tree.query(queries)[1]]

    def predict(self, x: Array, phase: Array) -> Array:
        """Y (C, Y) of the nearest frame for each row of x (C, X); the phase is ignored.

        Each row gets its own search. Runs are not played on and transitions are not smoothed, because both
        need a character's memory.
        """
        return self.frames[self.nearest_rows(self.input_features(standardise_inputs(self, x)))]

    def prepared(self, mode: str, storage: str) -> MatchingPredictor:
        """As in `Network`. int16 halves the memory of the frames."""
        return MatchingPredictor(self, storage)

    def engine_data(
        self, mode: str, storage: str, inputs: NDArray[np.int64]
    ) -> tuple[dict[str, int], dict[str, np.ndarray]]:
        """As in `Network`. findable: 1 for the rows `start_rows`. Other sections have the names of fields."""
        predictor, findable = MatchingPredictor(self, storage), np.zeros(len(self.remaining), np.uint8)
        findable[self.start_rows] = 1
        sizes = {"form": RECORDED, "rows": len(findable), "features": len(self.columns), "every": self.every}
        return sizes, {
            "frames": predictor.frames,
            "frame_scale": predictor.scale,
            "features": self.features.astype(np.float32),
            "feature_columns": self.columns.astype(np.int32),
            "feature_weights": self.feature_weights.astype(np.float32),
            "phases": self.phase.astype(np.float32),
            "remaining": self.remaining.astype(np.int32),
            "findable": findable,
        }


class MatchingPredictor(Predictor):
    """Motion matching prepared to run; a `hobble.models.network.Predictor`.

    storage: how it keeps the frames: "float32", or "int16" with a factor for each column.
    """

    network: Matching

    def __init__(self, network: Matching, storage: str) -> None:
        super().__init__(network)
        self.frames, self.scale = network.frames, np.ones(network.frames.shape[1], np.float32)
        if storage == "int16":
            self.scale = np.maximum(np.abs(network.frames).max(axis=0) / 32767, 1e-30).astype(np.float32)
            self.frames = np.round(network.frames / self.scale).astype(np.int16)
        self._transitions = Transitions(network.layout, network.halflife)
        _ = network.tree  # build the tree now, not in the first frame

    def evaluate(self, z: Array, phase: Array, out: Array, memory: Array | None = None) -> None:
        """As in `Predictor`. memory: (C, M) float64 with M = `Network.memory_size`. With None or zeros, each
        character shows the frame nearest to its inputs."""
        network, transitions = self.network, self._transitions
        if memory is None:
            memory = np.zeros((len(z), network.memory_size))
        before, following = self._rows_in_turn(memory[:, ROW])
        # `not <` and not `>=`, so that a NaN in the memory leads to a search.
        due, new = (following < 0) | ~(memory[:, SINCE] + 1 < network.every), before < 0
        shown = following.copy()
        if due.any():
            shown[due] = self._search(network.input_features(z[due]), following[due])
        memory[new] = 0.0
        memory[:, ROW], memory[:, SINCE] = shown + 1, np.where(due, 0, memory[:, SINCE] + 1)
        offsets, jumps = transitions.of(memory[:, OFFSETS:]), ~new & (shown != following)
        if jumps.any():
            offsets[jumps] = self._jump(offsets[jumps], before[jumps], following[jumps], shown[jumps])
        out[:] = pose = self._poses(shown)
        transitions.advance(offsets, out)
        transitions.pull_phase(network.phase[shown], phase, out)
        out[new] = pose[new]

    def _poses(self, rows: NDArray[np.int64]) -> Array:
        return np.asarray(self.frames[rows] * self.scale)

    def _rows_in_turn(self, stored: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """The last row (C,) that each character showed, or -1, and the next row (C,) of its run, or -1.

        stored: (C,) the numbers at ROW in the memories, which may be any.
        """
        remaining = self.network.remaining
        valid = (stored >= 1) & (stored <= len(remaining))
        before = np.where(valid, stored, 0).astype(np.int64) - 1
        return before, np.where(valid & (remaining[before] > 0), before + 1, -1)

    def _jump(
        self, offsets: Array, before: NDArray[np.int64], following: NDArray[np.int64], row: NDArray[np.int64]
    ) -> Array:
        """The offsets (C, J, 4, 3) after C characters have jumped to rows (C,), instead of to `following`.

        If the old run has ended (`following` is -1), the last pose shown takes the place of the next one, and
        rotation speeds are not known. They are rotations of joints from one row to the next of a run, so a
        search finds no row that is the first of a run.
        """
        goes_on, transitions = following >= 0, self._transitions
        transitions.add(offsets, self._poses(np.where(goes_on, following, before)), self._poses(row))
        speeds = offsets[goes_on]
        before, following, row = before[goes_on], following[goes_on], row[goes_on]
        transitions.add_rotation_speeds(speeds, self._poses(before), self._poses(following), 1.0)
        previous = np.maximum(row - 1, 0)
        transitions.add_rotation_speeds(speeds, self._poses(previous), self._poses(row), -1.0)
        offsets[goes_on] = speeds
        return offsets

    def _search(self, queries: Array, following: NDArray[np.int64]) -> NDArray[np.int64]:
        """The rows (C,) to show for the features `queries` (C, n) of C characters.

        following: (C,) the next row of each character's run, or -1 if the run ends. The search finds the row
        nearest to the query. The following row is shown instead if it is as near, or if the row found is at
        most SURROUNDING rows away from it.
        """
        network = self.network
        difference = queries - network.features[following]
        distance = np.where(following >= 0, np.sqrt(np.square(difference).sum(axis=1)), np.inf)
        _, nearest = network.tree.query(queries, distance_upper_bound=float(distance.max()))
        # The tree returns len(start_rows) where it finds no row within the bound.
        found = network.start_rows[np.minimum(nearest, len(network.start_rows) - 1)]
        nearer = np.square(queries - network.features[found]).sum(axis=1) < distance**2
        stay = ~nearer | (np.abs(found - following) <= SURROUNDING)
        return np.where(stay & (following >= 0), following, found)


@dataclass(frozen=True)
class Transitions:
    """Keeps the offsets of characters, which make the transitions to other frames smooth.

    The offsets of C characters are (C, J, 4, 3): position, velocity, rotation and rotation speed of J joints.
    halflife: in frames. After as many frames, 60 % is left of an offset that was at rest.
    """

    layout: RowLayout
    halflife: float

    def of(self, memory: Array) -> Array:
        """The offsets in the memories (C, 12 J) of C characters, as a view."""
        return memory.reshape(len(memory), self.layout.joints, 4, 3)

    def add(self, offsets: Array, old: Array, new: Array) -> None:
        """Add the differences between the poses `old`, which would have come, and `new`, both rows of Y."""
        (position, velocity, rotation), (to, speed, turn) = self._joints(old), self._joints(new)
        offsets[:, :, 0] += position - to
        offsets[:, :, 1] += velocity - speed
        offsets[:, :, 2] = _turned(offsets[:, :, 2], _turn_between(turn, rotation))

    def add_rotation_speeds(self, offsets: Array, before: Array, pose: Array, sign: float) -> None:
        """Add the rotations of the joints from the poses `before` to the next ones, times `sign`."""
        earlier, later = self._joints(before)[2], self._joints(pose)[2]
        offsets[:, :, 3] += sign * _turn_between(earlier, later)

    def advance(self, offsets: Array, out: Array) -> None:
        """Advance the offsets by one frame, and add them to the poses `out` (C, Y).

        An offset x with the damping d follows x'' = -2 d x' - d^2 x (Holden's article). The solution is
        x = e^(-d t) (x0 + j t), and x' = e^(-d t) (v0 - d j t), with j = v0 + d x0.
        """
        damping = 2.0 * np.log(2.0) / self.halflife
        fade, (x, v) = np.exp(-damping), (offsets[:, :, ::2], offsets[:, :, 1::2])
        j = v + x * damping
        x[...], v[...] = fade * (x + j), fade * (v - j * damping)
        position, velocity, rotation = self._joints(out)
        position += offsets[:, :, 0].astype(np.float32)
        velocity += offsets[:, :, 1].astype(np.float32)
        rotation[...] = _turned(offsets[:, :, 2], rotation)

    def pull_phase(self, wanted: Array, phase: Array, out: Array) -> None:
        """Change the change of phase in `out` (C, Y), so that the phases (C,) approach the `wanted` ones."""
        lag = wanted - phase
        lag -= np.floor(lag + 0.5)  # at most half a cycle, forwards or backwards
        out[:, self.layout.y_phase_change.start] += np.clip(lag, -FASTEST_PULL, FASTEST_PULL)

    def _joints(self, y: Array) -> list[Array]:
        """Positions, velocities and rotations (C, J, 3) in rows of Y, as views."""
        layout = self.layout
        blocks = layout.y_joint_position, layout.y_joint_velocity, layout.y_joint_rotation
        return [y[:, block].reshape(len(y), layout.joints, 3) for block in blocks]


def _turned(turn: Array, rotation: Array) -> Array:
    """The rotation vectors (..., 3) of `rotation`, followed by `turn`."""
    return quat.log(quat.mul(quat.exp(turn), quat.exp(rotation)))


def _turn_between(before: Array, after: Array) -> Array:
    """The rotation vectors (..., 3) from `before` to `after`."""
    return _turned(after, -np.asarray(before, float))
