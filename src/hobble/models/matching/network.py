"""Motion matching with the interface of a network: it plays recorded frames, which a search chooses.

The class reads and checks the file, searches the frames, and packs them for the report's page.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.models import checks
from hobble.models.matching.inertia import memory_size
from hobble.models.matching.predictor import MatchingPredictor
from hobble.models.network import Network, standardise_inputs
from hobble.models.packing import pack_table, to_base64

# Largest number of rows of the tables. The page keeps row numbers in float32, which is exact up to here.
MOST_ROWS = 1 << 24
MOST_WEIGHT = 1e9  # largest weight of a feature
MOST_FRAMES = 1_000_000  # largest number of frames between two searches, and largest half-life in frames
# A run is a sequence of consecutive frames of a clip. A search skips rows with fewer frames left in their
# run, because playback would soon reach its end.
FEWEST_LEFT = 20
# About this many rows are put in the report's page, as 5.5 MB of text. A page with several characters should
# stay below 20 MB.
MOST_ON_PAGE = 5500


@dataclass(frozen=True)
class Matching(Network):
    """Motion matching over R frames of clips, in runs of consecutive frames.

    columns: (n,) the columns of X that a search compares, called features. weights: (n,) their factors.
    features: (R, n) float32, these columns of each frame, times their factors. frames: (R, Y) float32, the Y
    of each frame, in raw units. phases: (R,) float32, in cycles. remaining: (R,) how many frames follow each
    frame in its run. every: frames between two searches. halflife: of the offsets that smooth a transition
    to another frame, in frames (`hobble.models.matching.inertia`).
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
        """As in `Model`. arrays: those of `hobble.models.matching.build.Tables`."""
        meta, inputs, outputs = (
            shared_fields["meta"],
            len(shared_fields["x_mean"]),
            len(shared_fields["y_mean"]),
        )
        frames = checks.read_numbers(path, arrays, "frames", 2, checks.LARGEST_MEAN)
        features = checks.read_numbers(path, arrays, "features", 2, checks.LARGEST_MEAN)
        phases = checks.read_numbers(path, arrays, "phase", 1, 1.0)
        weights = checks.read_numbers(path, arrays, "feature_weights", 1, MOST_WEIGHT)
        columns = _whole_numbers(path, arrays, "columns", inputs - 1)
        remaining = _whole_numbers(path, arrays, "remaining", MOST_ROWS)
        rows, n = len(frames), len(columns)
        expected = {"frames": (rows, outputs), "features": (rows, n), "phase": (rows,), "remaining": (rows,)}
        arrays_read = {"frames": frames, "features": features, "phase": phases, "remaining": remaining}
        for name, shape in expected.items():
            if arrays_read[name].shape != shape:
                raise InputError(path, f"{name} has shape {arrays_read[name].shape}, expected {shape}")
        if weights.shape != (n,) or weights.min() < 0:
            raise InputError(path, f"feature_weights has to hold {n} numbers of 0 or more")
        if rows > MOST_ROWS:
            raise InputError(path, f"{rows} frames; at most {MOST_ROWS} are allowed")
        # With this check, a character that plays a run never gets beyond the end of the table.
        if (
            remaining[-1] != 0
            or (remaining[:-1][remaining[:-1] > 0] != remaining[1:][remaining[:-1] > 0] + 1).any()
        ):
            raise InputError(path, "remaining has to count down by 1 a row, to 0 at the end of each run")
        if shared_fields["skeleton"] is None:
            raise InputError(path, "motion matching needs a skeleton, but the meta of the file has none")
        return cls(
            features=features,
            frames=frames,
            phases=phases,
            remaining=remaining,
            columns=columns,
            weights=weights,
            every=checks.require_whole_number(path, "every", meta.get("every"), 1, MOST_FRAMES),
            halflife=checks.require_number_in_range(path, "halflife", meta.get("halflife"), MOST_FRAMES),
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
        """Indices (S,) of the rows that a search may find.

        These rows are not near the end of a run (FEWEST_LEFT), and not the first of a run: rotation speeds
        are computed from the row before. If all runs are too short, a search may find all rows but the first
        of each run. If every run has only one row, it may find all rows.
        """
        is_first = np.r_[True, self.remaining[:-1] == 0]
        far_from_end = np.flatnonzero((self.remaining >= FEWEST_LEFT) & ~is_first)
        if len(far_from_end):
            return far_from_end
        return np.flatnonzero(~is_first) if (~is_first).any() else np.arange(len(is_first))

    @cached_property
    def tree(self) -> cKDTree:
        """A k-d tree of the features of the rows `start_rows`."""
        return cKDTree(self.features[self.start_rows])

    @property
    def memory_size(self) -> int:
        """As in `Network`: the row shown, the number of frames since the last search, and the offsets."""
        return memory_size(self.layout.joints)

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

    def page_data(self, inputs: NDArray[np.int64], outputs: NDArray[np.int64]) -> dict[str, Any]:
        """As in `Network`. Frames are integers with a factor for each column. Features stay float32, so that
        the page finds the same rows. Large tables are shortened to about MOST_ON_PAGE rows."""
        return self.shortened_copy(MOST_ON_PAGE)._all_for_page(inputs, outputs)

    def _all_for_page(self, inputs: NDArray[np.int64], outputs: NDArray[np.int64]) -> dict[str, Any]:
        """What `page` returns, but with all rows.

        The keys have the names of the fields, except for: `start`: `start_rows`. `at`: positions in `outputs`
        of the first columns of joint positions and velocities, and of the change of phase; -1 if left out.
        `turning`: the joints whose rotations are among `outputs`, each with the position of its first column.
        """
        place_in_inputs = {int(column): i for i, column in enumerate(inputs)}
        place_in_outputs = {int(column): i for i, column in enumerate(outputs)}
        on_page = [i for i, column in enumerate(self.columns) if int(column) in place_in_inputs]
        layout = self.layout
        blocks = layout.y_joint_position, layout.y_joint_velocity, layout.y_phase_change
        rotation_columns = {j: layout.y_joint_rotation.start + 3 * j for j in range(layout.joints)}
        return {
            "frames": pack_table(self.frames[:, outputs]),
            "features": to_base64(self.features[:, on_page].astype(np.float32)),
            "columns": [place_in_inputs[int(column)] for column in self.columns[on_page]],
            "weights": to_base64(self.weights[on_page]),
            "phases": to_base64(self.phases),
            "remaining": to_base64(np.minimum(self.remaining, 1 << 30).astype(np.int32)),  # 2^30 fits int32
            "start": to_base64(self.start_rows.astype(np.int32)),
            "every": self.every,
            "halflife": self.halflife,
            "memory": self.memory_size,
            "joints": layout.joints,
            "at": [place_in_outputs.get(block.start, -1) for block in blocks],
            "turning": [
                [j, place_in_outputs[column]]
                for j, column in rotation_columns.items()
                if column in place_in_outputs
            ],
        }


def _whole_numbers(path: str | Path, arrays: Mapping[str, Any], name: str, most: int) -> NDArray[np.int64]:
    """The array `name` of whole numbers (n,) from 0 to `most`."""
    if name not in arrays:
        raise InputError(path, f"not a network for motion matching: it has no array {name}")
    array = np.asarray(arrays[name])
    if array.dtype.kind not in "iu" or array.ndim != 1 or not array.size:
        raise InputError(
            path, f"{name} has shape {array.shape} and type {array.dtype}, not a list of whole numbers"
        )
    if array.min() < 0 or array.max() > most:
        raise InputError(path, f"{name} holds numbers outside 0 to {most}")
    return array.astype(np.int64)
