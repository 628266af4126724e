"""Recognises limps, also mild ones: what hurts, the side, and the strength relative to people's strong limps.

An impairment is a direction in which people's walks differ from their normal walks. At strength s the mean of
the features is s times their mean over people. The covariance is s^2 times that over people, plus that of
healthy walks. So a mild limp is modelled as part of the way from a person's normal to their impaired walk,
without a generator of limps. Impairments that the data cannot distinguish share a label (PARTS).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path

import numpy as np

from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.gait.features import ARMS, TRUNK, TRUNK_FORWARD, TRUNK_LEFT, features
from hobble.gait.people import NORMAL, People, people
from hobble.gait.profile import Profile
from hobble.gait.recogniser import RIGHT, SIDES, examples

HEALTHY = Path(__file__).with_name("healthy.npz")
GUARDED_ARM, LEANING = "guarded_arm", "leaning_trunk"
WAYS = {"forward": (1, 0), "backward": (-1, 0), "to the left": (0, 1), "to the right": (0, -1)}
# label -> the parts of the body that may hurt. Pain in thigh, shank or foot looks the same in people's data.
# Pain anywhere in an arm is recognised only by the swing of the arm.
PARTS: Mapping[str, tuple[str, ...]] = {
    NORMAL: (),
    "antalgic": ("thigh", "shank", "foot"),
    "stiff_legged": ("thigh", "shank"),
    "steppage": ("shank", "foot"),
    "trendelenburg": ("pelvis", "hip"),
    "lurch": ("hip", "back"),
    GUARDED_ARM: ("shoulder", "upper arm", "forearm", "hand"),
    LEANING: ("back",),
}
STRENGTHS = np.array([0.15, 0.3, 0.45, 0.6, 0.8, 1.0, 1.2])  # 1 is that of people; all are equally likely
HEALTHY_SPREAD = 2.5  # factor on the measured covariance, because an unmeasured figure may vary more
SHRINKAGE = 0.5  # of both covariances towards their diagonals


@dataclass(frozen=True)
class Grade:
    """What hurts. label: a key of PARTS. side: "right", "left" or None.

    strength: 0 for normal; 1 is as much as in the people who imitated the impairment. distance: from the
    nearest known walk, in standard deviations (root mean square over the features). For people who were left
    out of the learning it is 0.7 on average and at most 1.5; beyond that the label is less reliable.
    probabilities: of each label, both sides together. sides: probability of each (label, side or direction of
    the lean).
    """

    label: str
    side: str | None
    strength: float
    distance: float
    probabilities: Mapping[str, float] = field(repr=False)
    sides: Mapping[tuple[str, str], float] = field(repr=False)

    @property
    def parts(self) -> tuple[str, ...]:
        """The parts that may hurt."""
        return PARTS[self.label]

    @property
    def impaired(self) -> bool:
        """Whether an impairment is more likely than none."""
        return self.probabilities[NORMAL] < 0.5


@dataclass(frozen=True)
class Grader:
    """The known walks.

    kinds: (label, side or direction of the lean) -> mean (D,) and covariance (D, D) of the D features at
    strength 1, over people. healthy: (D, D) covariance of healthy walks.
    """

    kinds: Mapping[tuple[str, str], tuple[Array, Array]] = field(repr=False)
    healthy: Array = field(repr=False)

    @cached_property
    def _densities(self) -> tuple[Array, Array, Array]:
        """Normal distributions, n = 1 + kinds * strengths: of a healthy walk, then of each kind and strength.

        Means (n, D), whitening matrices (n, D, D), and log of the peak density times prior (n,), up to a
        common term.
        """
        each = [(s * mean, s**2 * spread) for mean, spread in self.kinds.values() for s in STRENGTHS]
        means, spreads = zip((np.zeros(len(self.healthy)), 0 * self.healthy), *each, strict=True)
        factors = np.linalg.cholesky(self.healthy + np.array(spreads))
        top = -np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
        top[1:] -= np.log(len(each))  # healthy and impaired have equal priors, and so do all kinds
        return np.array(means), np.linalg.inv(factors), top

    def grade(self, walk: Profile, healthy: Profile) -> Grade:
        """What hurts in a walk, relative to the figure's healthy walk."""
        x = np.array(list(features(walk, healthy).values()))
        means, whiten, top = self._densities
        squares = np.sum(np.einsum("nij,nj->ni", whiten, x - means) ** 2, axis=1)
        scores = top - 0.5 * squares
        distance = float(np.sqrt(squares[np.argmax(scores)] / len(x)))
        likely = np.exp(scores - scores.max())
        likely /= likely.sum()
        each = likely[1:].reshape(len(self.kinds), len(STRENGTHS))
        sides = {key: float(p) for key, p in zip(self.kinds, each.sum(axis=1), strict=True)}
        labels = {label: sum(p for key, p in sides.items() if key[0] == label) for label in PARTS}
        labels[NORMAL] = float(likely[0])
        label = max(labels, key=labels.__getitem__)
        if label == NORMAL:
            return Grade(label, None, 0.0, distance, labels, sides)
        key = max((key for key in sides if key[0] == label), key=sides.__getitem__)
        row = each[list(sides).index(key)]
        side, strength = key[1] if key[1] in SIDES else None, float(STRENGTHS @ row / row.sum())
        return Grade(label, side, strength, distance, labels, sides)


def learn_grader(known: People, whose: Iterable[int], healthy: Array) -> Grader:
    """Learn from the walks of some people (`whose`) and the covariance (D, D) of healthy walks."""
    values, classes = examples(known, whose)
    names = list(features(known.normal(), known.normal()))
    labels = np.array(classes)
    means = {name: values[labels == name].mean(axis=0) for name in dict.fromkeys(classes) if name != NORMAL}
    rest = np.concatenate([values[labels == name] - mean for name, mean in means.items()])
    spread = _shrunk(rest.T @ rest / len(rest))
    kinds = {tuple(name.split(" ")): (mean, spread) for name, mean in means.items()}
    for side in SIDES:
        kinds[GUARDED_ARM, side] = _only(names, (ARMS,), kinds["antalgic", side][0], spread)
    lean = abs(kinds["lurch", RIGHT][0][names.index(TRUNK_FORWARD)])
    for way, (forward, left) in WAYS.items():
        mean = np.zeros(len(names))
        mean[[names.index(TRUNK_FORWARD), names.index(TRUNK_LEFT)]] = lean * forward, lean * left
        kinds[LEANING, way] = _only(names, TRUNK, mean, spread)
    return Grader({(a, b): kind for (a, b), kind in kinds.items()}, HEALTHY_SPREAD * _shrunk(healthy))


@cache
def grader() -> Grader:
    """The grader that learnt from all data of the package."""
    return learn_grader(people(), range(people().count), healthy_covariance())


def healthy_covariance() -> Array:
    """(D, D) covariance of the features of healthy walks, relative to other healthy walks of the person."""
    known = load_npz(HEALTHY)
    return np.average(known["covariances"], axis=0, weights=known["clips"])


def grade(walk: Profile, healthy: Profile) -> Grade:
    """What hurts in a walk, relative to the figure's healthy walk."""
    return grader().grade(walk, healthy)


def _only(names: list[str], kept: Iterable[str], mean: Array, spread: Array) -> tuple[Array, Array]:
    """A kind that differs from a healthy walk only in the features `kept`."""
    on = np.isin(names, list(kept))
    return mean * on, np.diag(np.diag(spread) * on)


def _shrunk(covariance: Array) -> Array:
    return (1 - SHRINKAGE) * covariance + SHRINKAGE * np.diag(np.diag(covariance))
