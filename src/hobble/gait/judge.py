"""Compares the limps of one figure with those of real people, by 28 numbers: 21 features and 7 effects.

Three groups of people: the ten people of `hobble.gait.profile`, actors who pretended, and patients. Of
actors and patients, `groups.json` has the means, which `benchmarks/derive_gait.py groups` writes.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import numpy as np

from hobble.core.files import read_json
from hobble.core.quat import Array
from hobble.gait.profile import GAITS, NORMAL, Profile, features, measure_effects, read_people
from hobble.gait.recognise import SHRINKAGE, examples_of_people, healthy_covariance, learn

GROUPS_FILE = Path(__file__).with_name("groups.json")
EFFECTS_IN_NUMBERS = ("speed", "stride", "step_hurt", "step_sound", "knee_hurt", "knee_sound", "hip_sound")
# A feature counts as beyond people if it is further out than this share of the features of real people who
# are compared with all others.
LEFT_OUT_SHARE = 0.95


@dataclass(frozen=True)
class Limp:
    """A walk in which a part of the right leg hurts, and the same figure's healthy walk.

    part: hip, thigh, shank or foot. A walk with a hurt left leg has to be mirrored.
    """

    part: str
    severity: float
    guarding: float
    walk: Profile = field(repr=False)
    healthy: Profile = field(repr=False)

    @property
    def features(self) -> Array:
        """(21,)."""
        return np.array(list(features(self.walk, self.healthy).values()))

    @property
    def strength(self) -> float:
        """Root mean square of the features, in standard deviations of one person's healthy windows."""
        return _deviations(self.features)

    def apart(self, other: "Limp") -> float:
        """How much two limps differ, in the same unit."""
        return _deviations(self.features - other.features)

    @property
    def nearest(self) -> float:
        """Distance to the nearest limp of the ten people, in standard deviations of all their walks."""
        away = (limp_features_of_people() - self.features) / examples_of_people()[0].std(axis=0)
        return float(np.sqrt((away**2).mean(axis=-1)).min())


def _deviations(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2 / np.diag(healthy_covariance()))))


def numbers(walk: Profile, healthy: Profile) -> dict[str, float]:
    """The 28 numbers of a limp of the right leg."""
    effects = measure_effects(walk, healthy)
    return features(walk, healthy) | {name: effects[name] for name in EFFECTS_IN_NUMBERS}


@cache
def limp_features_of_people() -> Array:
    """(10, 5, 21) features of the five limps of each of the ten people."""
    return numbers_of_people()[..., : -len(EFFECTS_IN_NUMBERS)]


@cache
def numbers_of_people() -> Array:
    """(10, 5, 28) numbers of the five limps of each of the ten people."""
    limps = [[numbers(person[gait], person[NORMAL]) for gait in GAITS[1:]] for person in read_people()]
    return np.array([[[*limp.values()] for limp in of_person] for of_person in limps])


def _numbers(limps: Sequence[Limp]) -> Array:
    return np.array([[*numbers(limp.walk, limp.healthy).values()] for limp in limps])


def area_under_curve(limps: Sequence[Limp]) -> float:
    """How well a linear classifier tells limps from those of the ten people: .5 is not at all, 1 always.

    Each person and each part of the leg are left out of its training in turn. There must be two parts.
    """
    real, own, areas = numbers_of_people(), _numbers(limps), []
    parts = np.array([limp.part for limp in limps])
    for person, part in itertools.product(range(len(real)), dict.fromkeys(parts)):
        others, rest = np.concatenate(np.delete(real, person, axis=0)), own[parts != part]
        judge = learn(np.concatenate([others, rest]), ["real"] * len(others) + ["own"] * len(rest), SHRINKAGE)
        of_real, of_own = (np.diff(judge.scores(some))[:, 0] for some in (real[person], own[parts == part]))
        areas.append(np.mean(of_real[:, None] > of_own))
    return float(np.mean(areas))


@dataclass(frozen=True)
class Beyond:
    """A feature of a figure's mean limp that is above, or below, the means of all three groups.

    groups: the means of the ten people, the actors and the patients. by: how far it is from the nearest of
    them, in standard deviations of the mean limps of the ten people. counts: whether that is further than
    LEFT_OUT_SHARE of the features of left-out people are beyond (see `most_of_people`).
    """

    feature: str
    value: float
    groups: tuple[float, ...]
    by: float
    counts: bool


def beyond_people(limps: Sequence[Limp]) -> list[Beyond]:
    """The features in which the mean of a figure's limps is beyond the means of all three groups."""
    people, others = numbers_of_people(), np.array([[*group.values()] for group in groups().values()])
    mean, of_groups = _numbers(limps).mean(axis=0), np.vstack([people.mean(axis=(0, 1)), others])
    by, limit = _beyond(mean, of_groups), most_of_people()
    names = numbers(*2 * (read_people()[0][NORMAL],))
    return [
        Beyond(name, float(mean[k]), tuple(of_groups[:, k].tolist()), float(by[k]), bool(abs(by[k]) > limit))
        for k, name in enumerate(names)
        if by[k]
    ]


@cache
def groups() -> dict[str, dict[str, float]]:
    """Group -> name of each of the 28 numbers -> its mean over the actors or over the patients."""
    found: dict[str, dict[str, float]] = read_json(GROUPS_FILE)
    return found


@cache
def most_of_people() -> float:
    """How far a feature of a real person is beyond all groups, at the quantile LEFT_OUT_SHARE.

    The mean limp of each of the ten people is compared with the other nine, the actors and the patients,
    and all features of all people count alike.
    """
    return float(np.quantile(np.abs(_beyond_of_left_out()), LEFT_OUT_SHARE))


def counted_of_people() -> Array:
    """(10,) how many features of each of the ten people count as beyond, compared with all others."""
    return np.sum(np.abs(_beyond_of_left_out()) > most_of_people(), axis=1)


def _beyond_of_left_out() -> Array:
    people, others = numbers_of_people().mean(axis=1), np.array([[*g.values()] for g in groups().values()])
    rest = [np.delete(people, person, axis=0).mean(axis=0) for person in range(len(people))]
    return np.array([_beyond(own, np.vstack([mean, others])) for own, mean in zip(people, rest, strict=True)])


def _beyond(mean: Array, of_groups: Array) -> Array:
    """(28,) how far a mean is above all groups (G, 28), negative: below all; 0: in between."""
    above, below = mean - of_groups.max(axis=0), mean - of_groups.min(axis=0)
    return (np.maximum(above, 0.0) + np.minimum(below, 0.0)) / numbers_of_people().mean(axis=1).std(axis=0)
