"""Spearman's rank correlation of two series. Values of the second may be missing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hobble.core.quat import Array


def spearman(x: Sequence[float] | Array, y: Sequence[float | None]) -> float | None:
    """Spearman's rank correlation of the pairs (x, y) in which y is not None.

    None if fewer than 3 pairs remain or if all their y are equal.
    """
    pairs = [(a, b) for a, b in zip(x, y, strict=True) if b is not None]
    if len(pairs) < 3 or len({b for _, b in pairs}) < 2:
        return None
    ranks = np.array([_ranks(np.array(v)) for v in zip(*pairs, strict=True)])
    return round(float(np.corrcoef(ranks)[0, 1]), 5)


def _ranks(values: Array) -> Array:
    """The rank of each value (N,), from 1. Equal values get the mean of their ranks."""
    _, group, count = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(count) - (count - 1) / 2)[group]
