"""Motion matching at run time: plays frames of the clips, searches every few frames, smooths transitions.

After Clavet, Motion Matching and the Road to Next-Gen Animation, GDC 2016.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hobble.core.quat import Array
from hobble.models.matching.inertia import find_following, show_rows
from hobble.models.network import STORAGES, inverse_or_0
from hobble.models.stack import standardise_columns

if TYPE_CHECKING:
    from hobble.models.matching.network import Matching

# If a search finds a row at most this many rows from the row that follows in the run, there is no transition
# (Holden et al. 2020).
SURROUNDING = 20


class MatchingPredictor:
    """Motion matching prepared to run; a `hobble.models.network.Predictor`.

    storage: how it keeps the frames: "float32", or "int16" with a factor for each column.
    """

    def __init__(self, network: Matching, storage: str = "float32") -> None:
        if storage not in STORAGES:
            raise ValueError(f"storage {storage!r}: not one of {', '.join(STORAGES)}")
        self.network = network
        self._frames, self._scale = network.frames, np.ones(network.frames.shape[1], np.float32)
        if storage == "int16":
            self._scale = np.maximum(np.abs(network.frames).max(axis=0) / 32767, 1e-30).astype(np.float32)
            self._frames = np.round(network.frames / self._scale).astype(np.int16)
        layout = network.layout
        blocks = (
            layout.y_joint_position, layout.y_joint_velocity, layout.y_joint_rotation, layout.y_phase_change
        )  # fmt: skip
        self._first_columns = np.array([block.start for block in blocks], np.int64)
        self._x_mean, self._x_inverse = (
            np.ascontiguousarray(statistic, np.float32)
            for statistic in (network.x_mean, inverse_or_0(network.x_std))
        )
        _ = network.tree  # build the tree now, not in the first frame

    def standardise(self, x: Array, z: Array) -> None:
        """As in `Predictor`."""
        standardise_columns(x, self._x_mean, self._x_inverse, z)

    def evaluate(self, z: Array, phase: Array, out: Array, memory: Array | None = None) -> None:
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
        table, choice = (self._frames, self._scale, network.phases), (before, following, due, shown)
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

    def predict(self, x: Array, phase: Array, out: Array | None = None, memory: Array | None = None) -> Any:
        """As in `Predictor`."""
        z = np.empty_like(x)
        self.standardise(x, z)
        if out is None:
            out = np.empty((len(x), self.network.frames.shape[1]), np.float32)
        self.evaluate(z, phase, out, memory)
        return out
