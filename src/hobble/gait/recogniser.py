"""Recognises which of five impairments a walk resembles, and which leg is impaired.

The recogniser is a linear classifier that learnt from people's walks, each relative to the same person's
normal walk. The people imitated impairments of the right leg. Their mirrored walks are the examples with an
impaired left leg.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from hobble.core.quat import Array
from hobble.gait.cycles import WalkCycles
from hobble.gait.discriminant import Discriminant, learn
from hobble.gait.features import features
from hobble.gait.people import GAITS, NORMAL, People, read_people
from hobble.gait.profile import Profile, mirror_profile

# Share by which the covariance is shrunk towards its diagonal: there are only 120 examples for 21 features.
SHRINKAGE = 0.2
LEAST_CYCLES = 3  # a window must have this many cycles of both legs together, and at least one of each leg
RIGHT, LEFT = "right", "left"
SIDES = (RIGHT, LEFT)


@dataclass(frozen=True)
class Impairment:
    """The impairment of a walk.

    label: one of people.GAITS. side: "right" or "left", the impaired leg; None if the label is "normal".
    probabilities: label -> probability, both sides together; their sum is 1. probability_by_side:
    (impairment, side), such as ("antalgic", "right") -> probability.
    """

    label: str
    side: str | None
    probabilities: Mapping[str, float] = field(repr=False)
    probability_by_side: Mapping[tuple[str, str], float] = field(repr=False)

    @property
    def is_impaired(self) -> bool:
        """Whether the walk is more likely impaired than normal."""
        return self.probabilities[NORMAL] < 0.5


def examples_of_people(recorded: People, numbers: Iterable[int]) -> tuple[Array, list[str]]:
    """Features (n, D) and classes of the n walks of some people: each walk as it is, and mirrored.

    numbers: which people of `recorded`, from 0. A class is "normal", or "antalgic right" and so on.
    """
    values, classes = [], []
    for person in numbers:
        healthy = recorded.profile(NORMAL, person)
        for gait in GAITS:
            walk = recorded.profile(gait, person)
            for side, w, h in ((RIGHT, walk, healthy), (LEFT, mirror_profile(walk), mirror_profile(healthy))):
                values.append(list(features(w, h).values()))
                classes.append(gait if gait == NORMAL else f"{gait} {side}")
    return np.array(values), classes


@cache
def classifier_of_all_people() -> Discriminant:
    """The classifier that learnt from all people in `people.npz`."""
    return learn(*examples_of_people(read_people(), range(read_people().count)), shrinkage=SHRINKAGE)


def recognise(walk: Profile, healthy: Profile, discriminant: Discriminant | None = None) -> Impairment:
    """The impairment of a walk, relative to the figure's healthy walk.

    discriminant: a classifier of the classes in `examples_of_people`; None: the one that learnt from all
    people.
    """
    discriminant = discriminant or classifier_of_all_people()
    scores = discriminant.scores(np.array([list(features(walk, healthy).values())]))[0]
    probabilities = np.exp(scores - scores.max())
    probabilities /= probabilities.sum()
    sides, labels = {}, dict.fromkeys(GAITS, 0.0)
    for name, p in zip(discriminant.classes, map(float, probabilities), strict=True):
        gait, _, impaired_side = name.partition(" ")
        labels[gait] += p
        if impaired_side:
            sides[gait, impaired_side] = p
    label = max(labels, key=labels.__getitem__)
    side = None if label == NORMAL else max(SIDES, key=lambda s: sides[label, s])
    return Impairment(label, side, labels, sides)


def windows_with_cycles(
    walk: WalkCycles, frames: int, seconds: float = 4.0, step: float = 1.0
) -> list[tuple[int, WalkCycles]]:
    """(first frame, cycles) of each window of a clip that has LEAST_CYCLES or more cycles.

    A window begins every `step` seconds and lasts `seconds` seconds. frames: number of frames of the clip.
    """
    length = round(seconds * walk.fps)
    starts = range(0, max(frames - length, 0) + 1, max(1, round(step * walk.fps)))
    parts = ((start, walk.within(start, start + length)) for start in starts)
    return [
        (start, part)
        for start, part in parts
        if len(part) and len(part.right) + len(part.left) >= LEAST_CYCLES
    ]
