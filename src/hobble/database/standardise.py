"""Standardises raw rows for a database, so that the reader needs little time to compose a row with a fit."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.database.statistics import Statistics
from hobble.rows.compose import blocks_without_terrain, lower_joints
from hobble.rows.layout import RowLayout


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
