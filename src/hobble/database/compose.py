"""Batches out of factorised rows: the columns of a frame and the heights of one of its terrain fits."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.database.layout import RowLayout
from hobble.database.precision import widen
from hobble.database.statistics import Statistics


def x_columns(layout: RowLayout) -> int:
    """Columns of a database's `x`: X without the terrain."""
    return layout.x_size - 3 * layout.samples


def fit_columns(layout: RowLayout) -> int:
    """Columns of a database's `fits`: the heights, then the lift."""
    return 3 * layout.samples + 1


def joint_heights(joints: slice) -> slice:
    """The heights in a block of joint positions."""
    return slice(joints.start + 1, joints.stop, 3)


def split_rows(
    layout: RowLayout, statistics: Statistics, x: Array, y: Array, fits: Array, count: np.ndarray
) -> tuple[Array, Array, Array]:
    """Standardised x, y and fits out of raw ones, so that composing is little more than copying.

    x: (R, x columns) X without the terrain. y: (R, Y). fits: (S, fit columns) heights and the mean to take
    off joint heights. count: (R,) fits of each row. In what comes back each row's joint heights have the mean
    over its fits taken off, and a fit's last column (the lift, cm) is what its own mean is above that: small
    numbers, which half precision holds well.
    """
    s, terrain = statistics, layout.x_terrain
    of_row = np.repeat(np.arange(len(count)), count)
    row_mean = np.bincount(of_row, fits[:, -1].astype(np.float64) / count[of_row], len(count))
    x, y = x.astype(np.float64), y.astype(np.float64)
    x[:, joint_heights(layout.x_joint_position)] -= row_mean[:, None]
    y[:, joint_heights(layout.y_joint_position)] -= row_mean[:, None]
    x = (x - np.delete(s.x_mean, terrain)) / np.delete(s.x_std, terrain)
    heights = (fits[:, :-1].astype(np.float64) - s.x_mean[terrain]) / s.x_std[terrain]
    lift = fits[:, -1] - row_mean[of_row]
    return x, (y - s.y_mean) / s.y_std, np.concatenate([heights, lift[:, None]], axis=1)


def compose(
    layout: RowLayout,
    statistics: Statistics,
    tables: tuple[Array, Array, Array],
    rows: np.ndarray,
    fit: np.ndarray,
    x: Array,
    y: Array,
) -> None:
    """Fill x (n, X) and y (n, Y), standardised float32, from tables of x, y and fits.

    rows: (n,) of x and y; fit: (n,) of fits. Plain gathers: 2 million rows a second and core with 31 joints.
    """
    terrain = layout.x_terrain
    of_frame, ground = widen(tables[0][rows]), widen(tables[2][fit])
    x[:, : terrain.start] = of_frame[:, : terrain.start]
    x[:, terrain.stop :] = of_frame[:, terrain.start :]
    x[:, terrain] = ground[:, :-1]
    if tables[1].dtype == y.dtype:
        np.take(tables[1], rows, axis=0, out=y, mode="clip")  # any other mode copies once more
    else:
        y[...] = widen(tables[1][rows])
    lift = ground[:, -1:].astype(np.float32)
    if lift.any():
        heights = joint_heights(layout.x_joint_position)
        x[:, heights] -= lift / statistics.x_std[heights]
        heights = joint_heights(layout.y_joint_position)
        y[:, heights] -= lift / statistics.y_std[heights]
