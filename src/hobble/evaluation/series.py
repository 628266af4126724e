"""How much two series of numbers differ, and a straight line through points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypedDict

import numpy as np


def difference_in_sds(mean_a: float, sd_a: float, mean_b: float, sd_b: float) -> float | None:
    """The difference of two means, in units of the mean of both standard deviations.

    This is 2 |mean_a - mean_b| / (sd_a + sd_b), equation 3.2 of Segerstedt 2021. None if both standard
    deviations are 0.

    >>> difference_in_sds(3.0, 0.5, 1.0, 1.5)
    2.0
    """
    deviations = sd_a + sd_b
    return 2 * abs(mean_a - mean_b) / deviations if deviations > 0 else None


class StraightLine(TypedDict):
    """The line y = intercept + slope x. points: number of points. r2: coefficient of determination.

    Unknown values are None.
    """

    slope: float | None
    intercept: float | None
    r2: float | None
    points: int


def fit_line(x: Sequence[float], y: Sequence[float]) -> StraightLine | None:
    """The least-squares line through the points (x, y); None if x has fewer than two different values.

    `r2` is None if all y are equal.
    """
    if len(set(x)) < 2:
        return None
    slope, intercept = np.polyfit(np.asarray(x, float), np.asarray(y, float), 1)
    rest = np.asarray(y) - (intercept + slope * np.asarray(x, float))
    spread = float(np.sum((np.asarray(y) - np.mean(y)) ** 2))
    r2 = 1 - float(np.sum(rest**2)) / spread if spread > 0 else None
    return {"slope": float(slope), "intercept": float(intercept), "r2": r2, "points": len(x)}
