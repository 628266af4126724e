"""Facts about the training data: range of each column, speed of the fastest joint, a row to start from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.models import checks
from hobble.rows.layout import GAITS, RowLayout, compose

# Name in the network's file -> field of `TrainingFacts`, for the fields with a number for each column.
ARRAYS = {
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
        columns = {name: getattr(self, key) for name, key in ARRAYS.items()}
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
        columns: dict[str, Any] = {
            key: np.asarray(a, np.float32) for key, a in zip(ARRAYS.values(), arrays, strict=True)
        }
        return cls(**columns, start_phase=start[2], fastest=fastest)

    @classmethod
    def read(
        cls, path: str | Path, arrays: Mapping[str, Any], x_size: int, y_size: int
    ) -> TrainingFacts | None:
        """The facts among the arrays of a network's file.

        None if the file has no facts, like the network that Holden et al. (2017) released. path: the file,
        for error messages. x_size, y_size: numbers of columns of X and Y. Raises InputError for facts that
        cannot be used.
        """
        if not any(name in arrays for name in (*ARRAYS, "start_phase", "fastest")):
            return None
        found: dict[str, Any] = {}
        for name, key in ARRAYS.items():
            found[key] = checks.read_numbers(path, arrays, name, 1, checks.LARGEST_MEAN)
            block, size = ("X", x_size) if key.startswith("x") or key == "start_x" else ("Y", y_size)
            if len(found[key]) != size:
                raise InputError(
                    path, f"{name} has {len(found[key])} numbers, but {block} has {size} columns"
                )
        for name in ("start_phase", "fastest"):
            if (
                name not in arrays
                or np.shape(arrays[name]) != ()
                or np.asarray(arrays[name]).dtype.kind != "f"
            ):
                raise InputError(path, f"{name} is missing or is not one floating-point number")
            found[name] = checks.require_number_in_range(path, name, float(arrays[name]), 1e6, -1e-9)
        for block in "xy":
            if (found[f"{block}_low"] > found[f"{block}_high"]).any():
                raise InputError(
                    path, f"{block.upper()}low is above {block.upper()}high in at least one column"
                )
        return cls(**found)


def _raw(layout: RowLayout, part: Any, ground: Array, lift: Array, statistics: Any) -> tuple[Array, Array]:
    """x (n, X) and y (n, Y) in raw units, with a terrain under each row.

    part: n rows. ground: (n, m) heights of the terrain. lift: (n, 1) cm by which the joints are lowered.
    statistics: means and standard deviations of the columns.
    """
    x, y = np.empty((len(part.x), layout.x_size), np.float32), part.y.copy()
    s = statistics
    compose(layout, part.x, ground, lift, x, y, s.x_std, s.y_std)
    return x * s.x_std + s.x_mean, y * s.y_std + s.y_mean
