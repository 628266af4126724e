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

from hobble.core.compiled import njit
from hobble.core.declared import ArrayOf, read_declared
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.models.load import LARGEST_MEAN, read_arrays
from hobble.models.matching.build import findable_rows
from hobble.models.network import RECORDED, STORAGES, Network, standardise_inputs
from hobble.models.predict import StandardisingPredictor
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
# Indices in `at`, the array with the first columns in Y of the joints' positions, velocities and rotations,
# and the column of the change of phase.
POSITION, VELOCITY, ROTATION, PHASE_CHANGE = 0, 1, 2, 3
FASTEST_PULL = 0.002  # cycles per frame: the phase is corrected toward the clip's phase by at most this


@dataclass(frozen=True)
class Playing:
    """The entries of `meta` for motion matching; see `Matching`."""

    every: Annotated[int, Field(strict=True, ge=1, le=MOST_FRAMES)]
    halflife: Annotated[float, Field(strict=True, gt=0, le=MOST_FRAMES)]


@dataclass(frozen=True)
class Matching(Network):
    """Motion matching over R frames of clips, in runs of consecutive frames.

    columns: (n,) the columns of X that a search compares, called features. weights: (n,) their factors.
    features: (R, n) float32, these columns of each frame, times their factors. frames: (R, Y) float32, the Y
    of each frame, in raw units. phases: (R,) float32, in cycles. remaining: (R,) how many frames follow each
    frame in its run. every: frames between two searches. halflife: of the offsets that smooth a transition
    to another frame, in frames (see `show_rows`).
    """

    kind: ClassVar[str] = "matching"
    uses_phase: ClassVar[bool] = False
    plays_recorded_poses: ClassVar[bool] = True

    features: Array = field(repr=False)
    frames: Array = field(repr=False)
    phases: Array = field(repr=False)
    remaining: NDArray[np.int64] = field(repr=False)
    columns: NDArray[np.int64] = field(repr=False)
    weights: Array = field(repr=False)
    every: int
    halflife: float

    @classmethod
    def read(cls, path: str | Path, arrays: Mapping[str, Any], shared_fields: Mapping[str, Any]) -> Matching:
        """As in `Model`. arrays: those of `hobble.models.matching.build.build`."""
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
        return cls(
            features=found["features"],
            frames=found["frames"],
            phases=found["phase"],
            remaining=remaining,
            columns=found["columns"],
            weights=found["feature_weights"],
            every=playing.every,
            halflife=playing.halflife,
            **shared_fields,
        )

    def shortened_copy(self, most: int) -> Matching:
        """A copy with only the first part of each run, so that about `most` rows remain in all.

        Returns the network itself if it has at most `most` rows.
        """
        rows = len(self.remaining)
        if rows <= most:
            return self
        first_rows = np.flatnonzero(np.r_[True, self.remaining[:-1] == 0])
        lengths = self.remaining[first_rows] + 1
        new_lengths = np.ceil(lengths * (most / rows)).astype(np.int64)
        place_in_run = np.arange(rows) - np.repeat(first_rows, lengths)
        remaining = np.repeat(new_lengths, lengths) - 1 - place_in_run
        in_copy = remaining >= 0
        return replace(
            self,
            features=self.features[in_copy],
            frames=self.frames[in_copy],
            phases=self.phases[in_copy],
            remaining=remaining[in_copy],
        )

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

    @property
    def description(self) -> str:
        """As in `Network`."""
        return f"motion matching over {len(self.frames):,} frames of clips"

    def input_features(self, z: Array) -> Array:
        """The weighted features (C, n) float32 of C characters, from their standardised inputs z (C, X)."""
        raw = z[:, self.columns] * self.x_std[self.columns] + self.x_mean[self.columns]
        return np.ascontiguousarray(raw * self.weights, np.float32)

    def nearest_rows(self, queries: Array) -> NDArray[np.int64]:
        """The rows (C,) among `start_rows` whose features are nearest to the features `queries` (C, n)."""
        return self.start_rows[self.tree.query(queries)[1]]

    def predict(self, x: Array, phase: Array) -> Array:
        """Y (C, Y) of the nearest frame for each row of x (C, X); the phase is ignored.

        Each row gets its own search. Runs are not played on and transitions are not smoothed, because both
        need a character's memory.
        """
        return self.frames[self.nearest_rows(self.input_features(standardise_inputs(self, x)))]

    def predictor(self, mode: str | None = None, storage: str | None = None) -> MatchingPredictor:
        """As in `Network`; there is one mode. int16 halves the memory of the frames."""
        self.resolve_mode(mode)
        return MatchingPredictor(self, storage or self.default_storage)

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
            "feature_weights": self.weights.astype(np.float32),
            "phases": self.phases.astype(np.float32),
            "remaining": self.remaining.astype(np.int32),
            "findable": findable,
        }

    def copy_for_page(self) -> Matching:
        """As in `Network`: the beginnings of all runs, about MOST_ON_PAGE rows."""
        return self.shortened_copy(MOST_ON_PAGE)


class MatchingPredictor(StandardisingPredictor):
    """Motion matching prepared to run; a `hobble.models.network.Predictor`.

    storage: how it keeps the frames: "float32", or "int16" with a factor for each column.
    """

    network: Matching

    def __init__(self, network: Matching, storage: str = "float32") -> None:
        super().__init__(network)
        if storage not in STORAGES:
            raise ValueError(f"storage {storage!r}: not one of {', '.join(STORAGES)}")
        self.frames, self.scale = network.frames, np.ones(network.frames.shape[1], np.float32)
        if storage == "int16":
            self.scale = np.maximum(np.abs(network.frames).max(axis=0) / 32767, 1e-30).astype(np.float32)
            self.frames = np.round(network.frames / self.scale).astype(np.int16)
        self._first_columns = first_columns(network.layout)
        _ = network.tree  # build the tree now, not in the first frame

    def evaluate(self, z: Array, phase: Array, out: Array, memory: Any = None, *_: Any) -> None:
        """As in `Predictor`. memory: (C, M) float64 with M = `Network.memory_size`. With None or zeros, each
        character shows the frame nearest to its inputs."""
        network, count = self.network, len(z)
        if memory is None:
            memory = np.zeros((count, network.memory_size))
        before, following = np.empty(count, np.int64), np.empty(count, np.int64)
        due = np.empty(count, np.bool_)
        find_following(memory, network.remaining, network.every, before, following, due)
        shown = following.copy()
        if due.any():
            searching = np.flatnonzero(due)
            shown[searching] = self._search(network.input_features(z[searching]), following[searching])
        table, choice = (self.frames, self.scale, network.phases), (before, following, due, shown)
        show_rows(
            memory, table, choice, phase, (network.layout.joints, self._first_columns, network.halflife), out
        )

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


def first_columns(layout: RowLayout) -> NDArray[np.int64]:
    """The columns of Y at POSITION, VELOCITY, ROTATION and PHASE_CHANGE."""
    blocks = layout.y_joint_position, layout.y_joint_velocity, layout.y_joint_rotation, layout.y_phase_change
    return np.array([block.start for block in blocks], np.int64)


@njit
def find_following(memory: Any, remaining: Any, every: int, before: Any, following: Any, due: Any) -> None:
    """Find the next row of each character's run, and whether the character needs a search.

    memory: (C, M) for C characters. remaining: (R,) how many frames follow each row in its run. every: frames
    between two searches.

    Writes three arrays (C,). before: the last row shown, or -1 if there is none. following: the row after
    `before`, or -1 if the run ends or `before` is -1. due: whether to search.
    """
    rows = len(remaining)
    for c in range(len(memory)):
        row = memory[c, ROW]
        valid = 1 <= row <= rows
        before[c] = np.int64(row) - 1 if valid else -1
        following[c] = before[c] + 1 if valid and remaining[before[c]] > 0 else -1
        # `not <` and not `>=`, so that a NaN in the memory leads to a search.
        due[c] = following[c] < 0 or not memory[c, SINCE] + 1 < every


# Each of these types is a tuple of arguments of `show_rows`. The comment names its items in their order.
#
# frames: (R, Y), the poses divided by `scale`. scale: (Y,). phases: (R,).
Table = tuple[Any, Any, Any]
# before, following, due: from `find_following`. shown: (C,) the row that each character shows now.
Choice = tuple[Any, Any, Any, Any]
# joints: number of joints. at: (4,) columns in Y, see POSITION. halflife: of the offsets, in frames.
Shape = tuple[int, Any, float]


@njit(error_model="numpy")
def show_rows(memory: Any, table: Table, choice: Choice, phase: Any, shape: Shape, out: Any) -> None:
    """Write the pose of each character, the row to show plus the offsets, into `out` (C, Y).

    Updates memory (C, M). phase: (C,) the characters' phases; the change of phase in `out` is corrected, so
    that the character's phase approaches that of the row. If the row to show is not the following one, a
    transition starts. The row should then not be the first of a run, because its rotation speed is computed
    from the row before it.
    """
    frames, scale, phases = table
    before, following, due, shown = choice
    joints, at, halflife = shape
    # As in Holden's article. After `halflife` frames, 60 % is left of an offset that was at rest.
    damping = 2.0 * np.log(2.0) / halflife
    for c in range(len(memory)):
        row = shown[c]
        out[c] = frames[row] * scale
        if before[c] < 0:
            memory[c] = 0.0
        else:
            if row != following[c]:
                _start_transition(memory[c], frames, scale, before[c], following[c], row, joints, at)
            _decay_offsets(memory[c, OFFSETS:], damping)
            _add_offsets(memory[c, OFFSETS:], joints, at, out[c])
            out[c, at[PHASE_CHANGE]] += _pull(phases[row], phase[c])
        memory[c, ROW] = row + 1
        memory[c, SINCE] = 0 if due[c] else memory[c, SINCE] + 1


@njit(error_model="numpy")
def smooth_jumps(offsets: Any, before: Any, jumps: Any, at: Any, halflife: float, out: Any) -> None:
    """Add the offsets (C, 12 joints) of C characters to their poses in `out` (C, Y), after they have decayed.

    Where `jumps` (C,) is true, the difference between the pose that would have come, in `before` (C, Y), and
    that in `out` is first added to the offsets. at, halflife: as in `show_rows`.
    """
    joints, damping = offsets.shape[1] // OFFSETS_PER_JOINT, 2.0 * np.log(2.0) / halflife
    for c in range(len(out)):
        if jumps[c]:
            _add_difference(offsets[c], before[c], out[c], joints, at)
        _decay_offsets(offsets[c], damping)
        _add_offsets(offsets[c], joints, at, out[c])


@njit(error_model="numpy")
def pull_phase(phases: Any, phase: Any, chosen: Any, at: Any, out: Any) -> None:
    """Correct the change of phase in `out` (C, Y) of the `chosen` (C,) characters, as `show_rows` does.

    phases, phase: (C,) of the poses and of the characters, in cycles.
    """
    for c in range(len(out)):
        if chosen[c]:
            out[c, at[PHASE_CHANGE]] += _pull(phases[c], phase[c])


@njit(forceinline=True, cache=False)
def _pull(wanted: float, phase: float) -> float:
    """What to add to the change of a phase so that it approaches the phase `wanted`."""
    lag = wanted - phase
    lag -= np.floor(lag + 0.5)  # at most half a cycle, forwards or backwards
    return min(max(lag, -FASTEST_PULL), FASTEST_PULL)


@njit(forceinline=True, cache=False)
def _start_transition(
    memory: Any, frames: Any, scale: Any, before: int, following: int, row: int, joints: int, at: Any
) -> None:
    """Add the difference between two poses to the offsets: the pose that would have come next, minus `row`'s.

    If the old run has ended (`following` is -1), the last pose shown takes the place of the next one.
    """
    offsets = memory[OFFSETS:]
    old, new = frames[following if following >= 0 else before] * scale, frames[row] * scale
    # A joint's rotation speed is its rotation from one row to the next of the same run.
    before_old, before_new = frames[before] * scale, frames[max(row - 1, 0)] * scale
    _add_difference(offsets, old, new, joints, at)
    if following < 0:
        return
    r = np.empty(3)
    for j in range(joints):
        column, k = at[ROTATION] + 3 * j, OFFSETS_PER_JOINT * j + 9
        _rotation_since(before_old, old, column, r)
        for i in range(3):
            offsets[k + i] += r[i]
        _rotation_since(before_new, new, column, r)
        for i in range(3):
            offsets[k + i] -= r[i]


@njit(forceinline=True, cache=False)
def _add_difference(offsets: Any, old: Any, new: Any, joints: int, at: Any) -> None:
    """Add pose `old` minus pose `new`, rows of Y, to the offsets of positions, velocities and rotations."""
    q, p, r = np.empty(4), np.empty(4), np.empty(3)  # two quaternions and a rotation vector
    for j in range(joints):
        k = OFFSETS_PER_JOINT * j
        for i in range(3):
            offsets[k + i] += old[at[POSITION] + 3 * j + i] - new[at[POSITION] + 3 * j + i]
            offsets[k + 3 + i] += old[at[VELOCITY] + 3 * j + i] - new[at[VELOCITY] + 3 * j + i]
        column = at[ROTATION] + 3 * j
        _exp(old, column, q)
        _exp(new, column, p)
        _rotation_between(q, p, r)
        _exp(offsets, k + 6, p)
        _exp(r, 0, q)
        _log_of_product(p, q, offsets, k + 6)


@njit(forceinline=True, cache=False)
def _decay_offsets(offsets: Any, damping: float) -> None:
    """Advance the offsets and their speeds by one frame.

    An offset x with the damping d follows x'' = -2 d x' - d^2 x. The solution is x = e^(-d t) (x0 + j t), and
    x' = e^(-d t) (v0 - d j t), with j = v0 + d x0.
    """
    fade = np.exp(-damping)
    for k in range(0, len(offsets), 6):  # three offsets, then their three speeds
        for i in range(k, k + 3):
            j = offsets[i + 3] + offsets[i] * damping
            offsets[i], offsets[i + 3] = fade * (offsets[i] + j), fade * (offsets[i + 3] - j * damping)


@njit(forceinline=True, cache=False)
def _add_offsets(offsets: Any, joints: int, at: Any, y: Any) -> None:
    """Add the offsets to the pose in the row y (Y,)."""
    q, p = np.empty(4), np.empty(4)
    for j in range(joints):
        k, column = OFFSETS_PER_JOINT * j, at[ROTATION] + 3 * j
        for i in range(3):
            y[at[POSITION] + 3 * j + i] += offsets[k + i]
            y[at[VELOCITY] + 3 * j + i] += offsets[k + 3 + i]
        _exp(offsets, k + 6, q)
        _exp(y, column, p)
        _log_of_product(q, p, y, column)


@njit(forceinline=True, cache=False)
def _exp(v: Any, i: int, q: Any) -> None:
    """Write the quaternion (w, x, y, z) of the rotation vector v[i : i + 3] into q."""
    half_angle = np.sqrt(v[i] * v[i] + v[i + 1] * v[i + 1] + v[i + 2] * v[i + 2])
    scale = np.sin(half_angle) / half_angle if half_angle > 1e-8 else 1.0
    q[0], q[1], q[2], q[3] = np.cos(half_angle), v[i] * scale, v[i + 1] * scale, v[i + 2] * scale


@njit(forceinline=True, cache=False)
def _log_of_product(a: Any, b: Any, v: Any, i: int) -> None:
    """Write the rotation vector of the quaternion product a b into v[i : i + 3], the shorter way round."""
    w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    if w < 0:
        w, x, y, z = -w, -x, -y, -z
    length = np.sqrt(x * x + y * y + z * z)
    scale = np.arctan2(length, w) / length if length > 1e-8 else 1.0
    v[i], v[i + 1], v[i + 2] = x * scale, y * scale, z * scale


@njit(forceinline=True, cache=False)
def _rotation_between(a: Any, b: Any, v: Any) -> None:
    """Write the rotation vector from b to a, that of a b^-1, into v. Replaces b by its inverse."""
    b[1], b[2], b[3] = -b[1], -b[2], -b[3]
    _log_of_product(a, b, v, 0)


@njit(forceinline=True, cache=False)
def _rotation_since(earlier: Any, now: Any, column: int, v: Any) -> None:
    """Write the rotation vector of a joint from row `earlier` to row `now` into v.

    column: the first column of the joint's rotation.
    """
    q, p = np.empty(4), np.empty(4)
    _exp(now, column, q)
    _exp(earlier, column, p)
    _rotation_between(q, p, v)
