"""Recognises limps, also mild ones: what hurts, on which side, and how strong the limp is.

The limps that the people of people.py imitated have the strength 1 on average. Strength 0.5 is half way from
the normal walk to this limp. The features (features.py) of a limp of strength s are modelled by a Gaussian
distribution. Its mean is s times the mean over people. Its covariance is s^2 times the covariance over
people, plus the covariance of healthy walks. Parts of the body whose pain the data cannot distinguish share a
label (PARTS).
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
from hobble.gait.people import NORMAL, People, read_people
from hobble.gait.profile import Profile
from hobble.gait.recogniser import RIGHT, SIDES, examples_of_people

HEALTHY_FILE = Path(__file__).with_name("healthy.npz")
GUARDED_ARM, LEANING = "guarded_arm", "leaning_trunk"
# direction in which the trunk leans -> its (forward, left) components
LEANS = {"forward": (1, 0), "backward": (-1, 0), "to the left": (0, 1), "to the right": (0, -1)}
# label -> the parts of the body that may hurt. Pain in thigh, shank or foot looks the same in the data.
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
# A walk is compared with limps of these strengths, all equally likely. 1 is the mean of people.
STRENGTHS = np.array([0.15, 0.3, 0.45, 0.6, 0.8, 1.0, 1.2])
HEALTHY_SPREAD = 2.5  # factor on the covariance of healthy walks, because an unknown figure may vary more
SHRINKAGE = 0.5  # share by which both covariances are shrunk towards their diagonals


@dataclass(frozen=True)
class Grade:
    """What hurts in a walk.

    label: a key of PARTS. side: "right", "left", or None for a normal walk or a leaning trunk. strength: 0
    for normal; 1 is the mean of the people who imitated the impairment. distance: how far the walk is from
    the mean of the likeliest limp or of healthy walks, in standard deviations (root mean square over the
    features). For people who were left out of the learning, the distance is 0.7 on average and at most 1.5;
    beyond 1.5 the label is less reliable. probabilities: label -> probability, both sides together.
    probability_by_side: (label, side or direction of the lean) -> probability.
    """

    label: str
    side: str | None
    strength: float
    distance: float
    probabilities: Mapping[str, float] = field(repr=False)
    probability_by_side: Mapping[tuple[str, str], float] = field(repr=False)

    @property
    def parts(self) -> tuple[str, ...]:
        """The parts of the body that may hurt."""
        return PARTS[self.label]

    @property
    def is_impaired(self) -> bool:
        """Whether the walk is more likely impaired than normal."""
        return self.probabilities[NORMAL] < 0.5


@dataclass(frozen=True)
class Grader:
    """The limps and the healthy walks with which a walk is compared.

    kinds: (label, side or direction of the lean) -> mean (D,) and covariance (D, D) of the D features at
    strength 1, over people. healthy: (D, D) covariance of healthy walks.
    """

    kinds: Mapping[tuple[str, str], tuple[Array, Array]] = field(repr=False)
    healthy: Array = field(repr=False)

    @cached_property
    def _densities(self) -> tuple[Array, Array, Array]:
        """n Gaussian distributions: one of healthy walks, then one for each of `kinds` and each of STRENGTHS.

        Returns their means (n, D), whitening matrices (n, D, D), and the logarithm (n,) of peak density times
        prior probability, up to a term that all n share.
        """
        limps = [(s * mean, s**2 * spread) for mean, spread in self.kinds.values() for s in STRENGTHS]
        means, spreads = zip((np.zeros(len(self.healthy)), 0 * self.healthy), *limps, strict=True)
        factors = np.linalg.cholesky(self.healthy + np.array(spreads))
        log_peaks = -np.log(np.diagonal(factors, axis1=1, axis2=2)).sum(axis=1)
        log_peaks[1:] -= np.log(len(limps))  # healthy and impaired have equal priors, and so do all limps
        return np.array(means), np.linalg.inv(factors), log_peaks

    def grade(self, walk: Profile, healthy: Profile) -> Grade:
        """What hurts in a walk, relative to the figure's healthy walk."""
        x = np.array(list(features(walk, healthy).values()))
        means, whitening, log_peaks = self._densities
        squared_distances = np.sum(np.einsum("nij,nj->ni", whitening, x - means) ** 2, axis=1)
        scores = log_peaks - 0.5 * squared_distances
        distance = float(np.sqrt(squared_distances[np.argmax(scores)] / len(x)))
        probabilities = np.exp(scores - scores.max())
        probabilities /= probabilities.sum()
        of_limps = probabilities[1:].reshape(len(self.kinds), len(STRENGTHS))
        sides = {key: float(p) for key, p in zip(self.kinds, of_limps.sum(axis=1), strict=True)}
        labels = {label: sum(p for key, p in sides.items() if key[0] == label) for label in PARTS}
        labels[NORMAL] = float(probabilities[0])
        label = max(labels, key=labels.__getitem__)
        if label == NORMAL:
            return Grade(label, None, 0.0, distance, labels, sides)
        key = max((key for key in sides if key[0] == label), key=sides.__getitem__)
        of_strengths = of_limps[list(sides).index(key)]
        strength = float(STRENGTHS @ of_strengths / of_strengths.sum())  # mean, weighted by probability
        side = key[1] if key[1] in SIDES else None
        return Grade(label, side, strength, distance, labels, sides)


def learn_grader(recorded: People, numbers: Iterable[int], healthy: Array) -> Grader:
    """Learn from the walks of some people and the covariance (D, D) of healthy walks.

    numbers: which people of `recorded`, from 0.
    """
    values, classes = examples_of_people(recorded, numbers)
    names = list(features(recorded.normal_profile(), recorded.normal_profile()))
    class_of_row = np.array(classes)
    impaired = [name for name in dict.fromkeys(classes) if name != NORMAL]  # such as "antalgic right"
    means = {name: values[class_of_row == name].mean(axis=0) for name in impaired}
    deviations = np.concatenate([values[class_of_row == name] - mean for name, mean in means.items()])
    covariance = _shrunk(deviations.T @ deviations / len(deviations))
    kinds = {tuple(name.split(" ")): (mean, covariance) for name, mean in means.items()}
    # A guarded arm of strength 1 swings as in the gait "antalgic".
    for side in SIDES:
        kinds[GUARDED_ARM, side] = _limited_to(names, (ARMS,), kinds["antalgic", side][0], covariance)
    # A leaning trunk of strength 1 leans as far as the trunk in the gait "lurch".
    lean = abs(kinds["lurch", RIGHT][0][names.index(TRUNK_FORWARD)])
    for direction, (forward, left) in LEANS.items():
        mean = np.zeros(len(names))
        mean[[names.index(TRUNK_FORWARD), names.index(TRUNK_LEFT)]] = lean * forward, lean * left
        kinds[LEANING, direction] = _limited_to(names, TRUNK, mean, covariance)
    return Grader({(a, b): kind for (a, b), kind in kinds.items()}, HEALTHY_SPREAD * _shrunk(healthy))


@cache
def grader_of_all_people() -> Grader:
    """The grader that learnt from all people in people.npz and all healthy walks in healthy.npz."""
    return learn_grader(read_people(), range(read_people().count), healthy_covariance())


def healthy_covariance() -> Array:
    """(D, D) covariance of the features of healthy walks, relative to the same person's other walks."""
    data = load_npz(HEALTHY_FILE)
    return np.average(data["covariances"], axis=0, weights=data["clips"])


def grade_walk(walk: Profile, healthy: Profile) -> Grade:
    """What hurts in a walk, relative to the figure's healthy walk."""
    return grader_of_all_people().grade(walk, healthy)


def _limited_to(
    names: list[str], changed: Iterable[str], mean: Array, covariance: Array
) -> tuple[Array, Array]:
    """Mean and covariance of a limp that differs from a healthy walk only in the features `changed`.

    names: of all features, in the order of `mean` and `covariance`.
    """
    varies = np.isin(names, list(changed))
    return mean * varies, np.diag(np.diag(covariance) * varies)


def _shrunk(covariance: Array) -> Array:
    """The covariance with smaller values off its diagonal."""
    return (1 - SHRINKAGE) * covariance + SHRINKAGE * np.diag(np.diag(covariance))
