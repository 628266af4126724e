"""Standardises raw rows for a database so that the reader can add a terrain fit to each at little cost."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.database.statistics import Statistics
from hobble.rows.compose import lower_joints, without_terrain
from hobble.rows.layout import RowLayout


def standardise_rows(
    layout: RowLayout, statistics: Statistics, x: Array, y: Array, fits: Array, count: np.ndarray
) -> tuple[Array, Array, Array]:
    """Standardised x, y and fits from raw ones.

    x: (R, columns of X without terrain). y: (R, Y). fits: (S, columns of a terrain fit) ground heights, then
    the mean height that has to be subtracted from the joint heights of the row. count: (R,) number of fits of
    each row. In the result, the average of this mean over all fits of a row is subtracted from the row's
    joint heights. The last column of a fit, its lift (cm), is what remains to be subtracted: the fit's mean
    minus the average. This is a small number, which half precision stores well.
    """
    s, terrain = statistics, layout.x_terrain
    of_row = np.repeat(np.arange(len(count)), count)
    row_mean = np.bincount(of_row, fits[:, -1].astype(np.float64) / count[of_row], len(count))
    x, y = x.astype(np.float64), y.astype(np.float64)
    lower_joints(x, without_terrain(layout)["joint_position"], row_mean[:, None])
    lower_joints(y, layout.y_joint_position, row_mean[:, None])
    x = (x - np.delete(s.x_mean, terrain)) / np.delete(s.x_std, terrain)
    heights = (fits[:, :-1].astype(np.float64) - s.x_mean[terrain]) / s.x_std[terrain]
    lift = fits[:, -1] - row_mean[of_row]
    return x, (y - s.y_mean) / s.y_std, np.concatenate([heights, lift[:, None]], axis=1)
