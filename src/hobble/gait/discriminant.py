"""Linear discriminant analysis: finds the class with the nearest mean, measured in spreads within classes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array

# Shrinkage of the covariance towards its diagonal, because there are few windows for so many features. Of the
# values 0.02 to 0.8, this one recognises left-out captured motion best.
SHRINKAGE = 0.02
CONSTANT = 1e-9  # features with a smaller spread, relative to their size, are constant and ignored
# Least spread within classes, relative to the spread of all values. Without it, a feature that is constant
# within classes would decide alone.
NARROWEST = 0.02


@dataclass(frozen=True)
class Discriminant:
    """A linear classifier of K classes.

    The scores of `classes` for n rows of D features, values (n, D), are values @ weights (D, K) + offset
    (K,).
    """

    classes: tuple[str, ...]
    weights: Array = field(repr=False)
    offset: Array = field(repr=False)

    def scores(self, values: Array) -> Array:
        """(n, K) log likelihood of each class up to a common term. All classes have the same prior."""
        return values @ self.weights + self.offset

    def names(self, values: Array) -> list[str]:
        """The likeliest class for each row of values (n, D)."""
        return [self.classes[k] for k in np.argmax(self.scores(values), axis=1)]


def learn(values: Array, labels: Sequence[str], shrinkage: float = SHRINKAGE) -> Discriminant:
    """Learn from values (n, D) and their labels. Raises ValueError for fewer than two classes.

    shrinkage: of the covariance towards its diagonal, 0 to 1. This is Fisher's linear discriminant with the
    pooled covariance of standardised values. Each class has the same weight, however many examples it has.
    """
    classes = tuple(sorted(set(labels)))
    if len(classes) < 2:
        raise ValueError("there must be two classes or more")
    which = np.array([classes.index(label) for label in labels])
    count = np.bincount(which)
    means = np.stack([values[which == k].mean(axis=0) for k in range(len(classes))])
    rest = values - means[which]
    share = 1 / (len(classes) * count[which])
    overall = values.std(axis=0)
    spread = np.maximum(np.sqrt(share @ rest**2), NARROWEST * overall)
    varies = overall > CONSTANT * (1 + np.abs(values).max(axis=0))
    scaled = rest[:, varies] / spread[varies]
    covariance = (1 - shrinkage) * (scaled * share[:, None]).T @ scaled + shrinkage * np.eye(varies.sum())
    weights = np.zeros((values.shape[1], len(classes)))
    weights[varies] = (
        np.linalg.solve(covariance, (means[:, varies] / spread[varies]).T) / spread[varies, None]
    )
    return Discriminant(classes, weights, -0.5 * np.sum(means.T * weights, axis=0))
