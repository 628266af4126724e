"""What hurts, which side, and how much of what people showed: a recogniser that is made for mild limps too.

Each impairment is a direction in which people's walks leave their normal walks. A walk at strength s lies
near s times the mean over people, spread like s times the spread over people plus the spread of healthy
walks; a healthy walk has the latter alone. The strengths in between are thus people's own walks, half-way
and so on, and nothing that a generator of limps has made. What the data cannot tell apart has one label:
see PARTS.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.gait.features import ARMS, TRUNK, features
from hobble.gait.people import NORMAL, People, people
from hobble.gait.profile import Profile
from hobble.gait.recogniser import SIDES, examples

HEALTHY = Path(__file__).with_name("healthy.npz")
GUARDED_ARM, LEANING = "guarded_arm", "leaning_trunk"
BOTH = "both"
# label -> the parts of the body that it can mean. Pain in thigh, shank or foot looks alike in people's
# data, and an arm is seen by its swing alone, wherever in it the pain is.
PARTS: Mapping[str, tuple[str, ...]] = {
    NORMAL: (),
    "antalgic": ("thigh", "shank", "foot"),
    "stiff_legged": ("thigh", "shank"),
    "steppage": ("shank", "foot"),
    "trendelenburg": ("hip",),
    "lurch": ("hip", "back"),
    GUARDED_ARM: ("shoulder", "arm", "forearm", "hand"),
    LEANING: ("back",),
}
STRENGTHS = np.array([0.15, 0.3, 0.45, 0.6, 0.8, 1.0, 1.2])  # of what people showed, all as likely
HEALTHY_SPREAD = 3.0  # times the measured covariance: a figure that nobody measured is less like itself
SHRINKAGE = 0.5  # of both covariances towards their diagonals


@dataclass(frozen=True)
class Grade:
    """What hurts. label: a key of PARTS. side: "right", "left", or None where it is neither's.

    strength: 0 where the label is normal; 1 is as much as people showed who imitated the impairment.
    probabilities: of each label, both sides together; sides: of each label and side.
    """

    label: str
    side: str | None
    strength: float
    probabilities: Mapping[str, float] = field(repr=False)
    sides: Mapping[tuple[str, str], float] = field(repr=False)

    @property
    def parts(self) -> tuple[str, ...]:
        """The parts that may be what hurts."""
        return PARTS[self.label]

    @property
    def impaired(self) -> bool:
        """Whether something hurting is likelier than nothing."""
        return self.probabilities[NORMAL] < 0.5


@dataclass(frozen=True)
class Grader:
    """For each (label, side): the mean (D,) at strength 1 and the covariance (D, D) over people there."""

    kinds: Mapping[tuple[str, str], tuple[Array, Array]] = field(repr=False)
    healthy: Array = field(repr=False)

    def grade(self, walk: Profile, healthy: Profile) -> Grade:
        """What hurts in the walk of a figure, beside its healthy walk."""
        x = np.array(list(features(walk, healthy).values()))
        keys = list(self.kinds)
        each = np.array([self._at_strengths(x, *self.kinds[key]) for key in keys])
        each -= np.log(len(keys) * len(STRENGTHS))
        none = _log_density(x, self.healthy)
        top = max(none, each.max())
        likely, none = np.exp(each - top), float(np.exp(none - top))
        total = likely.sum() + none
        sides = {key: float(p) for key, p in zip(keys, likely.sum(axis=1) / total, strict=True)}
        labels = {label: sum(p for key, p in sides.items() if key[0] == label) for label in PARTS}
        labels[NORMAL] = none / total
        label = max(labels, key=labels.__getitem__)
        if label == NORMAL:
            return Grade(label, None, 0.0, labels, sides)
        side = max((key[1] for key in keys if key[0] == label), key=lambda s: sides[label, s])
        row = likely[keys.index((label, side))]
        strength = float(STRENGTHS @ row / row.sum())
        return Grade(label, None if side == BOTH else side, strength, labels, sides)

    def _at_strengths(self, x: Array, mean: Array, spread: Array) -> list[float]:
        return [_log_density(x - s * mean, self.healthy + s**2 * spread) for s in STRENGTHS]


def learn_grader(known: People, whose: Iterable[int], healthy: Array) -> Grader:
    """From the walks of some people and the covariance (D, D) of healthy walks."""
    values, classes = examples(known, whose)
    names = list(features(known.normal(), known.normal()))
    labels = np.array(classes)
    means = {name: values[labels == name].mean(axis=0) for name in dict.fromkeys(classes) if name != NORMAL}
    rest = np.concatenate([values[labels == name] - mean for name, mean in means.items()])
    spread = _shrunk(rest.T @ rest / len(rest))
    kinds = {tuple(name.split(" ")): (mean, spread) for name, mean in means.items()}
    for side in SIDES:
        kinds[GUARDED_ARM, side] = _only(names, (ARMS,), kinds["antalgic", side][0], spread)
    lean = np.mean([np.outer(mean, mean) for mean in means.values()], axis=0) + spread
    kinds[LEANING, BOTH] = _only(names, TRUNK, np.zeros(len(names)), lean)
    return Grader({(a, b): kind for (a, b), kind in kinds.items()}, HEALTHY_SPREAD * _shrunk(healthy))


@cache
def grader() -> Grader:
    """Learnt from all that the package knows."""
    return learn_grader(people(), range(people().count), load_npz(HEALTHY)["covariance"])


def grade(walk: Profile, healthy: Profile) -> Grade:
    """What hurts in the walk of a figure, beside its healthy walk."""
    return grader().grade(walk, healthy)


def _only(names: list[str], kept: Iterable[str], mean: Array, spread: Array) -> tuple[Array, Array]:
    """A kind in which nothing but the features `kept` differs from a healthy walk."""
    on = np.isin(names, list(kept))
    return mean * on, np.diag(np.diag(spread) * on)


def _shrunk(covariance: Array) -> Array:
    return (1 - SHRINKAGE) * covariance + SHRINKAGE * np.diag(np.diag(covariance))


def _log_density(x: Array, covariance: Array) -> float:
    """Of a normal distribution about 0, without the constant that all share."""
    factor = np.linalg.cholesky(covariance)
    return float(-0.5 * np.sum(np.linalg.solve(factor, x) ** 2) - np.log(np.diag(factor)).sum())
