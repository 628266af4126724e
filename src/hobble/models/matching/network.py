"""Motion matching with the interface of a network: reading, search, page data."""

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

MOST_ROWS = 1 << 24  # the page keeps row numbers in float32, which is exact up to here
MOST_WEIGHT = 1e9
MOST_FRAMES = 1_000_000  # largest `every` and half-life, in frames
FEWEST_LEFT = 20  # a search finds only rows that at least this many frames of their run follow
MOST_ON_PAGE = 5500  # rows, about 5.5 MB of text; a page with several characters should stay below 20 MB


@dataclass(frozen=True)
class Matching(Network):
    """Motion matching over R frames of clips, in runs of consecutive frames.

    features: (R, n) float32, weighted. frames: (R, Y) float32, raw units. phases: (R,) float32. remaining:
    (R,) how many frames follow in the run. columns: (n,) the columns of X that are features. weights: (n,)
    their factors. every: frames between two searches. halflife: of the offsets of a transition, frames.
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
        """From the arrays that `Tables.arrays` wrote; see `hobble.models.load`."""
        meta, inputs, outputs = common["meta"], len(common["x_mean"]), len(common["y_mean"])
        frames = checks.numbers(path, arrays, "frames", 2, checks.LARGEST_MEAN)
        features = checks.numbers(path, arrays, "features", 2, checks.LARGEST_MEAN)
        phases = checks.numbers(path, arrays, "phase", 1, 1.0)
        weights = checks.numbers(path, arrays, "feature_weights", 1, MOST_WEIGHT)
        columns = _whole(path, arrays, "columns", inputs - 1)
        remaining = _whole(path, arrays, "remaining", MOST_ROWS)
        rows, n = len(frames), len(columns)
        expected = {"frames": (rows, outputs), "features": (rows, n), "phase": (rows,), "remaining": (rows,)}
        found = {"frames": frames, "features": features, "phase": phases, "remaining": remaining}
        for name, shape in expected.items():
            if found[name].shape != shape:
                raise InputError(path, f"{name} has shape {found[name].shape}, expected {shape}")
        if weights.shape != (n,) or weights.min() < 0:
            raise InputError(path, f"feature_weights has to hold {n} numbers of 0 or more")
        if rows > MOST_ROWS:
            raise InputError(path, f"{rows} frames; at most {MOST_ROWS} are allowed")
        # This check guarantees that playing a run never leaves the table.
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
            every=checks.whole(path, "every", meta.get("every"), 1, MOST_FRAMES),
            halflife=checks.length(path, "halflife", meta.get("halflife"), MOST_FRAMES),
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
        some = remaining >= 0
        return replace(
            self,
            features=self.features[some],
            frames=self.frames[some],
            phases=self.phases[some],
            remaining=remaining[some],
        )

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """Indices of the rows that a search may find: not near the end of a run, and not its first row.

        The first row of a run has no rotation speed. If all runs are too short, these are all rows but the
        first of each run; if there are no such rows, they are all rows.
        """
        begins = np.r_[True, self.remaining[:-1] == 0]
        found = np.flatnonzero((self.remaining >= FEWEST_LEFT) & ~begins)
        return found if len(found) else np.flatnonzero(~begins) if (~begins).any() else np.arange(len(begins))

    @cached_property
    def tree(self) -> cKDTree:
        """A k-d tree of the features of `starts`."""
        return cKDTree(self.features[self.starts])

    @property
    def memory(self) -> int:
        """As in `Network`: the row shown, the frames since the search, and the offsets."""
        return memory_size(self.layout.joints)

    @property
    def sizes(self) -> tuple[int, ...]:
        """As in `Network`: there are no layers."""
        return ()

    @property
    def parameters(self) -> int:
        """Numbers in its tables."""
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

        Each row is searched on its own, without the runs and transitions of a character.
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
        place = {int(column): i for i, column in enumerate(inputs)}
        there = [i for i, column in enumerate(self.columns) if int(column) in place]
        used, layout = self.columns[there], self.layout
        rank = {int(column): i for i, column in enumerate(outputs)}
        turn = layout.y_joint_rotation
        turning = [j for j in range(layout.joints) if turn.start + 3 * j in rank]
        return {
            "frames": packed_columns(self.frames[:, outputs]),
            "features": packed(self.features[:, there].astype(np.float32)),
            "columns": [place[int(c)] for c in used],
            "weights": packed(self.weights[there]),
            "phases": packed(self.phases),
            "remaining": packed(np.minimum(self.remaining, 1 << 30).astype(np.int32)),
            "start": packed(self.starts.astype(np.int32)),
            "every": self.every,
            "halflife": self.halflife,
            "memory": self.memory,
            "joints": layout.joints,
            "at": [rank.get(block.start, -1) for block in _moving(layout)],
            "turning": [[j, rank[turn.start + 3 * j]] for j in turning],
        }


def _moving(layout: Any) -> list[slice]:
    return [layout.y_joint_position, layout.y_joint_velocity, layout.y_phase_change]


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
