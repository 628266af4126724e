"""The difference of two series, and a straight line through points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypedDict

import numpy as np


def difference(mean_a: float, sd_a: float, mean_b: float, sd_b: float) -> float | None:
    """2 |mean_a - mean_b| / (sd_a + sd_b), eq. 3.2 of Segerstedt 2021; None if both deviations are 0.

    >>> difference(3.0, 0.5, 1.0, 1.5)
    2.0
    """
    deviations = sd_a + sd_b
    return 2 * abs(mean_a - mean_b) / deviations if deviations > 0 else None


class StraightLine(TypedDict):
    """The line y = intercept + slope x through `points` points, and its r2. Unknown values are None."""

    slope: float | None
    intercept: float | None
    r2: float | None
    points: int


def line(x: Sequence[float], y: Sequence[float]) -> StraightLine | None:
    """The least-squares line y = intercept + slope x and its r2; None for fewer than two different x.

    r2 is None if all y are equal.
    """
    if len(set(x)) < 2:
        return None
    slope, intercept = np.polyfit(np.asarray(x, float), np.asarray(y, float), 1)
    rest = np.asarray(y) - (intercept + slope * np.asarray(x, float))
    spread = float(np.sum((np.asarray(y) - np.mean(y)) ** 2))
    r2 = 1 - float(np.sum(rest**2)) / spread if spread > 0 else None
    return {"slope": float(slope), "intercept": float(intercept), "r2": r2, "points": len(x)}
