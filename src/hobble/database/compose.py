"""Batches out of factorised rows: the columns of a frame and the heights of one of its terrain fits."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.database.layout import RowLayout
from hobble.database.statistics import Statistics


def frame_columns(layout: RowLayout) -> int:
    """Columns of a database's `frames`: X without the terrain, then Y."""
    return layout.x_size - 3 * layout.samples + layout.y_size


def fit_columns(layout: RowLayout) -> int:
    """Columns of a database's `fits`: the heights, then the lift."""
    return 3 * layout.samples + 1


def split_rows(
    layout: RowLayout, statistics: Statistics, frames: Array, fits: Array, count: np.ndarray
) -> tuple[Array, Array]:
    """Standardised frames and fits out of raw ones, so that composing is little more than copying.

    frames: (R, frame columns) raw X, severities and Y. fits: (S, fit columns) raw heights and the mean to
    take off joint heights. count: (R,) fits of each row. In what comes back each row's joint heights have
    the mean over its fits taken off, and a fit's last column (the lift, cm) is what its own mean is above
    that: small numbers, which half precision holds well.
    """
    s, terrain = statistics, layout.x_terrain
    of_row = np.repeat(np.arange(len(count)), count)
    row_mean = np.bincount(of_row, fits[:, -1].astype(np.float64) / count[of_row], len(count))
    x = frames[:, : -layout.y_size].astype(np.float64)
    y = frames[:, -layout.y_size :].astype(np.float64)
    x[:, layout.x_joint_position.start + 1 : layout.x_joint_position.stop : 3] -= row_mean[:, None]
    y[:, layout.y_joint_position.start + 1 : layout.y_joint_position.stop : 3] -= row_mean[:, None]
    x = (x - np.delete(s.x_mean, terrain)) / np.delete(s.x_std, terrain)
    y = (y - s.y_mean) / s.y_std
    heights = (fits[:, :-1].astype(np.float64) - s.x_mean[terrain]) / s.x_std[terrain]
    lift = fits[:, -1] - row_mean[of_row]
    return np.concatenate([x, y], axis=1), np.concatenate([heights, lift[:, None]], axis=1)


def compose(
    layout: RowLayout,
    statistics: Statistics,
    frames: Array,
    fits: Array,
    rows: np.ndarray,
    fit: np.ndarray,
    x: Array,
    y: Array,
) -> None:
    """Fill x (n, X) and y (n, Y), standardised float32, from rows (n,) of `frames` and fit (n,) of `fits`."""
    if frames.dtype != np.float32:
        frames, fits = frames[rows].astype(np.float32), fits[fit].astype(np.float32)
        rows = fit = np.arange(len(rows))
    x_heights = slice(layout.x_joint_position.start + 1, layout.x_joint_position.stop, 3)
    y_heights = slice(layout.y_joint_position.start + 1, layout.y_joint_position.stop, 3)
    _kernel()(
        frames,
        fits,
        rows,
        fit,
        layout.x_terrain.start,
        layout.links,
        x_heights.start,
        1 / statistics.x_std[x_heights],
        y_heights.start,
        1 / statistics.y_std[y_heights],
        x,
        y,
    )


@cache
def _kernel() -> Any:
    """The compiled loop; numba is imported here, so that only those who compose wait for it."""
    from numba import njit

    return njit(nogil=True, cache=True)(_gather)


def _gather(frames, fits, rows, fit, head, links, x_first, x_scale, y_first, y_scale, x, y):
    heights = fits.shape[1] - 1
    for i in range(len(rows)):
        row, ground = frames[rows[i]], fits[fit[i]]
        x[i, :head] = row[:head]
        x[i, head : head + heights] = ground[:heights]
        x[i, head + heights :] = row[head : head + links]
        y[i] = row[head + links :]
        lift = ground[heights]
        if lift != 0:
            for j in range(len(x_scale)):
                x[i, x_first + 3 * j] -= lift * x_scale[j]
                y[i, y_first + 3 * j] -= lift * y_scale[j]
