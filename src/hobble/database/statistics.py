"""Means and standard deviations of the columns of X and Y, over all pairs of a row and a terrain fit.

The pairs are not stored. Below, a deviation is a standard deviation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels import channel
from hobble.channels.channel import CONSTANT_BELOW, SILENCING_STD
from hobble.core.declared import ArrayOf, check_arrays
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.database.chunks import HINT
from hobble.rows.clip_rows import ClipRows
from hobble.rows.layout import (
    TERRAIN,
    RowLayout,
    blocks_without_terrain,
    body_inputs,
    body_layout,
    channel_inputs,
    lower_joints,
    pose_blocks,
)

UNSEEN = 1e-10  # input weight of a joint that the network shall not see, as in Holden et al. (2017)
LEAST_STD = 1e-30  # of a column in a file of statistics; rows are divided by it
BATCH = 2048  # rows of a clip are converted to float64 so many at a time, to use little memory


@dataclass(frozen=True)
class Moments:
    """Weight, mean and spread of rows with C columns, from which means and deviations are computed.

    weight: sum of the rows' weights. mean: (C,) weighted mean. squares: (C,) weighted sum of squared
    differences from the mean.
    """

    weight: float
    mean: Array = field(repr=False)
    squares: Array = field(repr=False)

    def __add__(self, other: Moments) -> Moments:
        """The moments of two sets of rows together (Chan, Golub and LeVeque, "Updating formulae", 1979)."""
        weight = self.weight + other.weight
        if weight == 0:
            return self
        delta = other.mean - self.mean
        mean = self.mean + delta * (other.weight / weight)
        squares = self.squares + other.squares + delta**2 * (self.weight * other.weight / weight)
        return Moments(weight, mean, squares)

    def columns(self, block: slice) -> Moments:
        """The moments of the columns `block`."""
        return Moments(self.weight, self.mean[block], self.squares[block])

    @property
    def std(self) -> Array:
        """(C,) population standard deviation, as `np.std` computes it. 0 if there are no rows."""
        return np.sqrt(self.squares / max(self.weight, 1e-300))

    @classmethod
    def of_no_rows(cls, columns: int) -> Moments:
        """The moments of no rows."""
        return cls(0.0, np.zeros(columns), np.zeros(columns))

    @classmethod
    def of_rows(cls, values: Array, weights: Array | None = None) -> Moments:
        """The moments of rows `values` (N, C). weights: (N,) the rows' weights; None: each has weight 1."""
        values = np.asarray(values, np.float64, order="C")
        if not len(values):
            return cls.of_no_rows(values.shape[1])
        w = np.ones((len(values), 1)) if weights is None else np.asarray(weights, np.float64)[:, None]
        total = float(w.sum())
        # Sums, not matrix products: the last bits of a product depend on the arrays' memory addresses.
        mean = (w * values).sum(axis=0) / total
        return cls(total, mean, (w * (values - mean) ** 2).sum(axis=0))


@dataclass(frozen=True)
class Statistics:
    """The means and deviations by which rows are standardised, float32. No deviation is 0.

    x_mean, x_std: (X,). y_mean, y_std: (Y,).
    """

    x_mean: Array = field(repr=False)
    x_std: Array = field(repr=False)
    y_mean: Array = field(repr=False)
    y_std: Array = field(repr=False)


def read_statistics(path: Path, layout: RowLayout) -> Statistics:
    """Read the file of a database's statistics. Raises InputError if it does not fit the layout."""
    arrays = load_npz(path)
    sizes = {"x": layout.x_size, "y": layout.y_size}
    shapes = {f"{block}_mean": ArrayOf((size,)) for block, size in sizes.items()}
    shapes |= {f"{block}_std": ArrayOf((size,), low=LEAST_STD) for block, size in sizes.items()}
    check_arrays(path, arrays, shapes, fix=HINT)
    return Statistics(**{name: arrays[name] for name in shapes})


def clip_moments(rows: ClipRows, layout: RowLayout) -> tuple[Moments, Moments]:
    """(Moments of X, moments of Y) over all pairs of a row of a clip and one of its terrain fits.

    layout: the columns of X and Y. Each row has weight 1, which its fits share equally. So the one fit of a
    row on flat ground counts as much as the ten fits of another row together.
    """
    body = body_layout(layout)
    x, y = Moments.of_no_rows(layout.x_size), Moments.of_no_rows(layout.y_size)
    first = rows.first_fit
    for start in range(0, len(rows), BATCH):
        part = slice(start, min(start + BATCH, len(rows)))
        fits = rows.fits[part]
        part_fits = slice(int(first[start]), int(first[part.stop - 1] + fits[-1]))
        fit_row = np.repeat(np.arange(len(fits)), fits)  # index of each fit's row
        weight = 1.0 / fits[fit_row]
        mean = rows.mean[part_fits].astype(np.float64)
        row_mean: Array = np.bincount(fit_row, weight * mean, len(fits)).astype(np.float64)
        spread = float(np.sum(weight * (mean - row_mean[fit_row]) ** 2))
        frames = body_inputs(layout, rows.x[part])
        x_frame = _moments_of_lowered(frames, body.x_joint_position, row_mean, spread)
        parts = {name: x_frame.columns(block) for name, block in blocks_without_terrain(body).items()}
        for name, _ in layout.channels:
            parts[name] = Moments.of_rows(channel_inputs(name, rows.channels[name][part]))
        parts[TERRAIN] = Moments.of_rows(rows.heights[part_fits], weight)
        x = x + _join_columns(*[parts[name] for name in layout.blocks("x")])
        y = y + _moments_of_lowered(rows.y[part, : layout.y_size], layout.y_joint_position, row_mean, spread)
    return x, y


def _moments_of_lowered(values: Array, joints: slice, row_mean: Array, spread: float) -> Moments:
    """Moments of all pairs of a row and a fit. In a pair, joint heights are above the fit's mean height.

    values: (R, C) the rows, with joint heights above 0. joints: columns of joint positions. row_mean: (R,)
    the average of the mean heights of a row's fits. spread: weighted sum over all fits of (mean height of the
    fit - row_mean of its row)^2. By the law of total variance, the squares of the pairs are those of the rows
    lowered by row_mean, plus `spread`.
    """
    values = values.astype(np.float64)
    heights = slice(joints.start + 1, joints.stop, 3)
    values[:, heights] -= row_mean[:, None]
    moments = Moments.of_rows(values)
    moments.squares[heights] += spread
    return moments


def _join_columns(*parts: Moments) -> Moments:
    """The moments of rows whose columns are those of all parts, side by side. Each part has the same rows."""
    mean = np.concatenate([part.mean for part in parts])
    return Moments(parts[0].weight, mean, np.concatenate([part.squares for part in parts]))


def x_groups(layout: RowLayout) -> list[slice]:
    """Groups of columns of X. The columns of a group share one deviation, as in Holden et al. (2017).

    The columns of channels are in no group.
    """
    half = layout.samples  # a trajectory block has this number of columns of x, then the same number of z
    split = [
        slice(start, start + half)
        for block in (layout.x_position, layout.x_direction)
        for start in (block.start, block.start + half)
    ]
    local = [layout.x_local_phase] if layout.local_phases else []
    return [*split, layout.x_gait, *pose_blocks(layout.blocks("x")), layout.x_terrain, *local]


def share_in_groups(std: Array, groups: Iterable[slice], constant: float) -> Array:
    """(C,) deviations that are equal in each group: the mean of the group's deviations.

    std: (C,) deviation of each column. A column that is in no group keeps its own. constant: the deviation of
    a group whose columns do not vary.
    """
    out = np.array(std, np.float64)
    for group in groups:
        mean = float(np.mean(std[group]))
        out[group] = mean if mean > CONSTANT_BELOW else constant
    return out


def statistics_of_moments(
    layout: RowLayout, x: Moments, y: Moments, joint_weight: float, skeleton: Mapping[str, Any]
) -> Statistics:
    """The statistics of rows with moments `x` and `y`. Groups of columns share a deviation (`x_groups`).

    skeleton: plain data. Its key `unseen`, if it is there, lists the names of the joints that the network
    shall not see in its input. The deviation of a joint's columns of X is divided by w * joint_weight, so
    that the standardised values are multiplied by it. w is UNSEEN for these joints, and 1 for others. Each
    channel defines the deviations of its columns.
    """
    x_std = share_in_groups(x.std, x_groups(layout), SILENCING_STD)
    w = np.where(np.isin(list(skeleton["joints"]), skeleton.get("unseen", ())), UNSEEN, 1.0)
    for block in pose_blocks(layout.blocks("x")):
        # At most 1e30, so that the value stays finite in float32.
        x_std[block] = np.minimum(x_std[block] / np.repeat(w * joint_weight, 3), 1e30)
    for name, _ in layout.channels:
        block = layout.x_channel(name)
        x_std[block] = channel(name).divisors(x.std[block])
    y_std = share_in_groups(y.std, layout.blocks("y").values(), 1.0)
    return Statistics(*(np.asarray(v, np.float32) for v in (x.mean, x_std, y.mean, y_std)))


# Standardises raw rows for a database, so that the reader needs little time to compose a row with a fit.


def standardise_rows(
    layout: RowLayout, statistics: Statistics, x: Array, y: Array, fits: Array, count: np.ndarray
) -> tuple[Array, Array, Array]:
    """Standardised (x, y, fits) from raw ones, with the same shapes.

    x: (R, columns of X without terrain). y: (R, Y). fits: (S, columns of a terrain fit): ground heights, then
    their mean height on the path, cm. count: (R,) number of fits of each row.

    A composed row has joint heights above the mean height of its fit. For each row, this function subtracts
    the average of the mean heights of all its fits. The reader subtracts the rest, the fit's mean height
    minus this average. The rest is called the lift (cm) and becomes the last column of the fits. It is a
    small number, which 16 bits store well.
    """
    s, terrain = statistics, layout.x_terrain
    fit_row = np.repeat(np.arange(len(count)), count)  # index of each fit's row
    row_mean = np.bincount(fit_row, fits[:, -1].astype(np.float64) / count[fit_row], len(count))
    x, y = x.astype(np.float64), y.astype(np.float64)
    lower_joints(x, blocks_without_terrain(layout)["joint_position"], row_mean[:, None])
    lower_joints(y, layout.y_joint_position, row_mean[:, None])
    x = (x - np.delete(s.x_mean, terrain)) / np.delete(s.x_std, terrain)
    heights = (fits[:, :-1].astype(np.float64) - s.x_mean[terrain]) / s.x_std[terrain]
    lift = fits[:, -1] - row_mean[fit_row]
    return x, (y - s.y_mean) / s.y_std, np.concatenate([heights, lift[:, None]], axis=1)
