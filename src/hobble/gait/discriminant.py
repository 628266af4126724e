"""Linear discriminant analysis: the class whose mean is nearest, measured in spreads within the classes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array

# Of the covariance towards its diagonal, since there are few windows for so many features; of 0.02 to 0.8,
# the one with which captured motion that was left out is named best.
SHRINKAGE = 0.02
CONSTANT = 1e-9  # spread, relative to the size of the numbers, below which a feature says nothing
NARROWEST = 0.02  # spread within the classes, of that over all, or a lucky constant would decide alone


@dataclass(frozen=True)
class Discriminant:
    """`classes`, and for each a linear score: values (n, D) @ weights (D, K) + offset (K,)."""

    classes: tuple[str, ...]
    weights: Array = field(repr=False)
    offset: Array = field(repr=False)

    def scores(self, values: Array) -> Array:
        """(n, K) log likelihood of each class up to a term that all share; no class is likelier before."""
        return values @ self.weights + self.offset

    def names(self, values: Array) -> list[str]:
        """The likeliest class of each of values (n, D)."""
        return [self.classes[k] for k in np.argmax(self.scores(values), axis=1)]


def learn(values: Array, labels: Sequence[str], shrinkage: float = SHRINKAGE) -> Discriminant:
    """From values (n, D) and their labels. Raises ValueError for fewer than two classes.

    shrinkage: of the covariance towards its diagonal, 0 to 1.

    Fisher's linear discriminant with the pooled covariance of standardised values; each class counts the
    same, however many examples it has.
    """
    classes = tuple(sorted(set(labels)))
    if len(classes) < 2:
        raise ValueError("one class cannot be told from another")
    which = np.array([classes.index(label) for label in labels])
    count = np.bincount(which)
    means = np.stack([values[which == k].mean(axis=0) for k in range(len(classes))])
    rest = values - means[which]
    share = 1 / (len(classes) * count[which])
    overall = values.std(axis=0)
    spread = np.maximum(np.sqrt(share @ rest**2), NARROWEST * overall)
    told = overall > CONSTANT * (1 + np.abs(values).max(axis=0))
    scaled = rest[:, told] / spread[told]
    covariance = (1 - shrinkage) * (scaled * share[:, None]).T @ scaled + shrinkage * np.eye(told.sum())
    weights = np.zeros((values.shape[1], len(classes)))
    weights[told] = np.linalg.solve(covariance, (means[:, told] / spread[told]).T) / spread[told, None]
    return Discriminant(classes, weights, -0.5 * np.sum(means.T * weights, axis=0))
