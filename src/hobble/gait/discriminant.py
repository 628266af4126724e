"""Linear discriminant analysis: finds the class whose mean is nearest.

Distances are measured in units of the spread of the examples within their classes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from hobble.core.quat import Array

# The covariance is shrunk towards its diagonal by this share, because there are few examples for so many
# features. Of the values 0.02 to 0.8, this one recognises left-out captured motion best.
SHRINKAGE = 0.02
CONSTANT_SPREAD = 1e-9  # features with a smaller spread, relative to their size, are constant and ignored
# The spread of a feature within classes counts as at least this share of its spread over all examples.
# Otherwise a feature that is constant within classes would decide alone.
LEAST_SPREAD_SHARE = 0.02


@dataclass(frozen=True)
class Discriminant:
    """A linear classifier of K classes.

    classes: their K names. weights: (D, K). offset: (K,). For n examples with values (n, D) of D features,
    the scores of the classes are values @ weights + offset.
    """

    classes: tuple[str, ...]
    weights: Array = field(repr=False)
    offset: Array = field(repr=False)

    def scores(self, values: Array) -> Array:
        """(n, K) log likelihood of each class, up to a term that all classes share.

        All classes have the same prior probability.
        """
        return values @ self.weights + self.offset

    def likeliest_classes(self, values: Array) -> list[str]:
        """The likeliest class for each row of values (n, D)."""
        return [self.classes[k] for k in np.argmax(self.scores(values), axis=1)]


def learn(values: Array, labels: Sequence[str], shrinkage: float = SHRINKAGE) -> Discriminant:
    """Learn from values (n, D) and their labels. Raises ValueError for fewer than two classes.

    The result is Fisher's linear discriminant with the pooled covariance of standardised values. Each class
    has the same weight, however many examples it has. shrinkage: the share, 0 to 1, by which the covariance
    is shrunk towards its diagonal.
    """
    classes = tuple(sorted(set(labels)))
    if len(classes) < 2:
        raise ValueError(f"there must be two classes or more, but the labels name {len(classes)}")
    class_index = np.array([classes.index(label) for label in labels])
    examples_of_class = np.bincount(class_index)
    means = np.stack([values[class_index == k].mean(axis=0) for k in range(len(classes))])
    deviations = values - means[class_index]
    example_weight = 1 / (len(classes) * examples_of_class[class_index])
    overall_spread = values.std(axis=0)
    spread = np.maximum(np.sqrt(example_weight @ deviations**2), LEAST_SPREAD_SHARE * overall_spread)
    varies = overall_spread > CONSTANT_SPREAD * (1 + np.abs(values).max(axis=0))
    scaled = deviations[:, varies] / spread[varies]
    weighted = scaled * example_weight[:, None]
    covariance = (1 - shrinkage) * weighted.T @ scaled + shrinkage * np.eye(varies.sum())
    # For each class, weights = inverse covariance @ mean, and offset = -mean @ weights / 2.
    weights = np.zeros((values.shape[1], len(classes)))
    weights[varies] = (
        np.linalg.solve(covariance, (means[:, varies] / spread[varies]).T) / spread[varies, None]
    )
    return Discriminant(classes, weights, -0.5 * np.sum(means.T * weights, axis=0))
