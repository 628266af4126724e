"""Facts of the training data: range of each column, speed of the fastest joint, and a row to start from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.models import checks
from hobble.rows.compose import compose
from hobble.rows.layout import GAITS, RowLayout

# Name in the network's file -> field of `TrainingFacts`, for the arrays with a number for each column.
ARRAYS = {
    "Xlow": "x_low",
    "Xhigh": "x_high",
    "Ylow": "y_low",
    "Yhigh": "y_high",
    "start_x": "start_x",
    "start_y": "start_y",
}
STANDING_GAIT = 0.99  # a row with at least this share of the gait "stand" counts as standing
# If less than this share of the rows stands, the start row is the row nearest to the mean.
MIN_STANDING_SHARE = 0.005


@dataclass(frozen=True)
class TrainingFacts:
    """Facts of the training rows, in raw units, float32.

    x_low, x_high (X,), y_low, y_high (Y,): smallest and largest value of each column. fastest: largest speed
    of any joint in any row, cm a frame. start_x (X,), start_y (Y,), start_phase: the row from which a
    character starts. It is the stillest standing row, or the row nearest to the mean if standing is rare.
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
        """The arrays for the network's file."""
        of_rows = {name: getattr(self, key) for name, key in ARRAYS.items()}
        return {**of_rows, "start_phase": np.float64(self.start_phase), "fastest": np.float64(self.fastest)}

    @classmethod
    def of(cls, layout: RowLayout, parts: Iterable[Any], statistics: Any) -> TrainingFacts:
        """The facts of all rows.

        parts: the rows, in blocks (`UncomposedRows` in `hobble.database.reader`). statistics: means and
        standard deviations of their columns (x_mean, x_std, y_mean, y_std).

        Only the ground differs between the terrain fits of a row. So a row is composed with its highest and
        with its lowest ground instead of with each fit. The start row is composed with its first fit.
        """
        s = statistics
        stand = layout.x_gait.start + GAITS.index("stand") * layout.samples + layout.samples // 2
        often_stands = s.x_mean[stand] > MIN_STANDING_SHARE
        body = np.r_[layout.x_position, layout.x_direction, layout.x_joint_position, layout.x_joint_velocity]
        low, high = (np.inf, np.inf), (-np.inf, -np.inf)
        best, start, fastest = np.inf, None, 0.0
        for part in parts:
            least, most = (f.reduceat(part.fits, part.first, axis=0) for f in (np.minimum, np.maximum))
            # The last column is subtracted from the heights of joints: where it is highest, they are lowest.
            rows = _raw(layout, part, least[:, :-1], most[:, -1:], s)
            low = tuple(np.minimum(a, values.min(axis=0)) for a, values in zip(low, rows, strict=True))
            rows = _raw(layout, part, most[:, :-1], least[:, -1:], s)
            high = tuple(np.maximum(a, values.max(axis=0)) for a, values in zip(high, rows, strict=True))
            first_fit = part.fits[part.first]
            x, y = _raw(layout, part, first_fit[:, :-1], first_fit[:, -1:], s)
            speed = np.linalg.norm(y[:, layout.y_joint_velocity].reshape(len(y), -1, 3), axis=-1)
            fastest = max(fastest, float(speed.max()))
            if often_stands:  # the stillest standing row
                far = np.square(x[:, layout.x_position]).sum(axis=1) + np.square(speed).sum(axis=1)
                far = np.where(x[:, stand] >= STANDING_GAIT, far, np.inf)
            else:
                far = np.square((x[:, body] - s.x_mean[body]) / s.x_std[body]).mean(axis=1)
            k = int(far.argmin())
            if start is None or far[k] < best:
                best, start = float(far[k]), (x[k], y[k], float(part.p[k]))
        assert start is not None, "a database has rows"
        arrays = (low[0], high[0], low[1], high[1], *start[:2])
        of_rows: dict[str, Any] = {
            key: np.asarray(a, np.float32) for key, a in zip(ARRAYS.values(), arrays, strict=True)
        }
        return cls(**of_rows, start_phase=start[2], fastest=fastest)

    @classmethod
    def read(
        cls, path: str | Path, arrays: Mapping[str, Any], x_size: int, y_size: int
    ) -> TrainingFacts | None:
        """The facts in a file's arrays; None if the file has none.

        The network that Holden et al. (2017) released has none. x_size, y_size: numbers of columns of X and
        Y. Raises InputError for facts that cannot be used.
        """
        if not any(name in arrays for name in (*ARRAYS, "start_phase", "fastest")):
            return None
        found: dict[str, Any] = {}
        for name, key in ARRAYS.items():
            found[key] = checks.numbers(path, arrays, name, 1, checks.LARGEST_MEAN)
            if len(found[key]) != (x_size if key.startswith("x") or key == "start_x" else y_size):
                raise InputError(path, f"{name} has {len(found[key])} columns")
        for name in ("start_phase", "fastest"):
            if (
                name not in arrays
                or np.shape(arrays[name]) != ()
                or np.asarray(arrays[name]).dtype.kind != "f"
            ):
                raise InputError(path, f"{name} is not a number")
            found[name] = checks.number_in_range(path, name, float(arrays[name]), 1e6, -1e-9)
        for block in "xy":
            if (found[f"{block}_low"] > found[f"{block}_high"]).any():
                raise InputError(path, f"{block.upper()}low is above {block.upper()}high in a column")
        return cls(**found)


def _raw(layout: RowLayout, part: Any, ground: Array, lift: Array, s: Any) -> tuple[Array, Array]:
    """x (n, X) and y (n, Y) in raw units.

    part: n rows. ground, lift: a fit for each row: ground heights (n, m), and the last column (n, 1). s: the
    statistics.
    """
    x, y = np.empty((len(part.x), layout.x_size), np.float32), part.y.copy()
    compose(layout, part.x, ground, lift, x, y, s.x_std, s.y_std)
    return x * s.x_std + s.x_mean, y * s.y_std + s.y_mean
