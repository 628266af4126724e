"""Motion matching with the interface of a network: reading, search, data for the report's page."""

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
from hobble.models.network import Network, standardised
from hobble.models.packing import packed, packed_columns

MOST_ROWS = 1 << 24  # in the tables; the page keeps row numbers in float32, which is exact up to here
MOST_WEIGHT = 1e9  # largest weight of a feature
MOST_FRAMES = 1_000_000  # largest `every` and half-life, in frames
FEWEST_LEFT = 20  # a search skips rows that have fewer frames left in their run
# At most this many rows are put in the page: 5.5 MB of text. A page with several characters should stay below
# 20 MB.
MOST_ON_PAGE = 5500


@dataclass(frozen=True)
class Matching(Network):
    """Motion matching over R frames of clips, in runs of consecutive frames.

    features: (R, n) float32, weighted. frames: (R, Y) float32, raw units. phases: (R,) float32. remaining:
    (R,) how many frames follow in the run. columns: (n,) the columns of X that are features. weights: (n,)
    their factors. every: frames between two searches. halflife: frames in which the offset of a transition
    falls to half.
    """

    kind: ClassVar[str] = "matching"
    phase: ClassVar[bool] = False
    recorded_poses: ClassVar[bool] = True

    features: Array = field(repr=False)
    frames: Array = field(repr=False)
    phases: Array = field(repr=False)
    remaining: NDArray[np.int64] = field(repr=False)
    columns: NDArray[np.int64] = field(repr=False)
    weights: Array = field(repr=False)
    every: int
    halflife: float

    @classmethod
    def read(cls, path: str | Path, arrays: Mapping[str, Any], common: Mapping[str, Any]) -> Matching:
        """From the arrays of a file, which `hobble.models.matching.build` made."""
        meta, inputs, outputs = common["meta"], len(common["x_mean"]), len(common["y_mean"])
        frames = checks.numbers(path, arrays, "frames", 2, checks.LARGEST_MEAN)
        features = checks.numbers(path, arrays, "features", 2, checks.LARGEST_MEAN)
        phases = checks.numbers(path, arrays, "phase", 1, 1.0)
        weights = checks.numbers(path, arrays, "feature_weights", 1, MOST_WEIGHT)
        columns = _whole(path, arrays, "columns", inputs - 1)
        remaining = _whole(path, arrays, "remaining", MOST_ROWS)
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
            raise InputError(path, "remaining does not count down to the end of each run")
        if common["skeleton"] is None:
            raise InputError(path, "motion matching needs a skeleton, but its meta has none")
        return cls(
            features=features,
            frames=frames,
            phases=phases,
            remaining=remaining,
            columns=columns,
            weights=weights,
            every=checks.whole_number(path, "every", meta.get("every"), 1, MOST_FRAMES),
            halflife=checks.number_in_range(path, "halflife", meta.get("halflife"), MOST_FRAMES),
            **common,
        )

    def shortened(self, most: int) -> Matching:
        """A copy with only the first part of each run, so that about `most` rows remain in all."""
        rows = len(self.remaining)
        if rows <= most:
            return self
        begins = np.flatnonzero(np.r_[True, self.remaining[:-1] == 0])
        lengths = self.remaining[begins] + 1
        kept = np.ceil(lengths * (most / rows)).astype(np.int64)
        within = np.arange(rows) - np.repeat(begins, lengths)
        remaining = np.repeat(kept, lengths) - 1 - within
        in_copy = remaining >= 0
        return replace(
            self,
            features=self.features[in_copy],
            frames=self.frames[in_copy],
            phases=self.phases[in_copy],
            remaining=remaining[in_copy],
        )

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """Indices of the rows where a search may start playing: neither the first of a run nor near its end.

        The first row of a run has no rotation speed. If all runs are too short, a search may find all rows
        but the first of each run. If every run has only one row, it may find all rows.
        """
        begins = np.r_[True, self.remaining[:-1] == 0]
        starts = np.flatnonzero((self.remaining >= FEWEST_LEFT) & ~begins)
        return (
            starts if len(starts) else np.flatnonzero(~begins) if (~begins).any() else np.arange(len(begins))
        )

    @cached_property
    def tree(self) -> cKDTree:
        """A k-d tree of the features of `starts`."""
        return cKDTree(self.features[self.starts])

    @property
    def memory(self) -> int:
        """As in `Network`: numbers for the row shown, the frames since the search, and the offsets."""
        return memory_size(self.layout.joints)

    @property
    def sizes(self) -> tuple[int, ...]:
        """As in `Network`: there are no layers."""
        return ()

    @property
    def parameters(self) -> int:
        """How many numbers its tables of frames and features hold."""
        return self.frames.size + self.features.size

    @property
    def described(self) -> str:
        """As in `Network`."""
        return f"motion matching over {len(self.frames):,} frames of clips"

    def queries(self, z: Array) -> Array:
        """The weighted features (C, n) float32 of standardised inputs z (C, X)."""
        raw = z[:, self.columns] * self.x_std[self.columns] + self.x_mean[self.columns]
        return np.ascontiguousarray(raw * self.weights, np.float32)

    def nearest(self, queries: Array) -> NDArray[np.int64]:
        """The rows (C,) whose features are nearest to queries (C, n)."""
        return self.starts[self.tree.query(queries)[1]]

    def predict(self, x: Array, phase: Array) -> Array:
        """Y (C, Y) of the nearest frame for each row of x (C, X); the phase is ignored.

        Each row gets its own search. There are no runs and transitions, which need a character's memory.
        """
        return self.frames[self.nearest(self.queries(standardised(self, x)))]

    def predictor(self, mode: str | None = None, storage: str | None = None) -> MatchingPredictor:
        """As in `Network`; there is one mode. int16 halves the memory of the frames."""
        self.mode(mode)
        return MatchingPredictor(self, storage or self.storage)

    def page(self, inputs: NDArray[np.int64], outputs: NDArray[np.int64]) -> dict[str, Any]:
        """As in `Network`. Frames are integers with a factor for each column. Features stay float32, so that
        the page finds the same rows. Large tables are shortened to MOST_ON_PAGE rows, see `shortened`."""
        return self.shortened(MOST_ON_PAGE)._packed(inputs, outputs)

    def _packed(self, inputs: NDArray[np.int64], outputs: NDArray[np.int64]) -> dict[str, Any]:
        """`page` without shortening.

        `at`: positions in `outputs` of the first columns of joint positions and velocities, and of the change
        of phase; -1 if left out. `turning`: the joints whose rotations are among `outputs`, each with the
        position of its first column.
        """
        of_input = {int(column): i for i, column in enumerate(inputs)}
        kept = [i for i, column in enumerate(self.columns) if int(column) in of_input]
        of_output, layout = {int(column): i for i, column in enumerate(outputs)}, self.layout
        blocks = layout.y_joint_position, layout.y_joint_velocity, layout.y_phase_change
        firsts = {j: layout.y_joint_rotation.start + 3 * j for j in range(layout.joints)}
        return {
            "frames": packed_columns(self.frames[:, outputs]),
            "features": packed(self.features[:, kept].astype(np.float32)),
            "columns": [of_input[int(column)] for column in self.columns[kept]],
            "weights": packed(self.weights[kept]),
            "phases": packed(self.phases),
            "remaining": packed(np.minimum(self.remaining, 1 << 30).astype(np.int32)),
            "start": packed(self.starts.astype(np.int32)),
            "every": self.every,
            "halflife": self.halflife,
            "memory": self.memory,
            "joints": layout.joints,
            "at": [of_output.get(block.start, -1) for block in blocks],
            "turning": [[j, of_output[first]] for j, first in firsts.items() if first in of_output],
        }


def _whole(path: str | Path, arrays: Mapping[str, Any], name: str, most: int) -> NDArray[np.int64]:
    """The array `name` of whole numbers (n,) from 0 to `most`."""
    if name not in arrays:
        raise InputError(path, f"not a network: no {name}")
    array = np.asarray(arrays[name])
    if array.dtype.kind not in "iu" or array.ndim != 1 or not array.size:
        raise InputError(path, f"{name} has shape {array.shape} and type {array.dtype}, not whole numbers")
    if array.min() < 0 or array.max() > most:
        raise InputError(path, f"{name} holds numbers outside 0 to {most}")
    return array.astype(np.int64)
