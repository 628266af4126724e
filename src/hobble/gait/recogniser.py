"""Recognises which of five impairments a walk resembles, and the side.

The recogniser is a linear classifier that learnt from people's walks, each relative to the same person's
normal walk. Walks with an impaired left leg are mirrored walks with an impaired right leg. Speed and stride
time are not used, and most features compare the two sides, because a healthy walk changes with its speed but
stays symmetric.
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
from hobble.gait.people import GAITS, NORMAL, People, people
from hobble.gait.profile import Profile, mirrored

SHRINKAGE = 0.2  # of the covariance towards its diagonal; there are 120 examples for some twenty features
LEAST_CYCLES = 3  # a window must have this many cycles of both legs together, and at least one of each leg
RIGHT, LEFT = "right", "left"
SIDES = (RIGHT, LEFT)


@dataclass(frozen=True)
class Impairment:
    """The impairment of a walk.

    label: one of people.GAITS. side: of the impaired leg, None if the label is normal. probabilities: label
    -> probability, both sides together; their sum is 1. sides: (impairment, side), such as ("antalgic",
    "right") -> probability.
    """

    label: str
    side: str | None
    probabilities: Mapping[str, float] = field(repr=False)
    sides: Mapping[tuple[str, str], float] = field(repr=False)

    @property
    def impaired(self) -> bool:
        """Whether an impairment is more likely than none."""
        return self.probabilities[NORMAL] < 0.5


def examples(recorded: People, numbers: Iterable[int]) -> tuple[Array, list[str]]:
    """Features (n, D) and classes of the walks of some people, each walk as it is and mirrored.

    numbers: which people of `recorded`, from 0. A class is "normal", or "antalgic right" and so on.
    """
    values, classes = [], []
    for person in numbers:
        healthy = recorded.profile(NORMAL, person)
        for gait in GAITS:
            walk = recorded.profile(gait, person)
            for side, w, h in ((RIGHT, walk, healthy), (LEFT, mirrored(walk), mirrored(healthy))):
                values.append(list(features(w, h).values()))
                classes.append(gait if gait == NORMAL else f"{gait} {side}")
    return np.array(values), classes


@cache
def classifier() -> Discriminant:
    """The classifier that learnt from all people in `people.npz`."""
    return learn(*examples(people(), range(people().count)), shrinkage=SHRINKAGE)


def recognise(walk: Profile, healthy: Profile, discriminant: Discriminant | None = None) -> Impairment:
    """The impairment of a walk, relative to the figure's healthy walk."""
    discriminant = discriminant or classifier()
    scores = discriminant.scores(np.array([list(features(walk, healthy).values())]))[0]
    likely = np.exp(scores - scores.max())
    likely /= likely.sum()
    sides, labels = {}, dict.fromkeys(GAITS, 0.0)
    for name, p in zip(discriminant.classes, map(float, likely), strict=True):
        gait, _, which = name.partition(" ")
        labels[gait] += p
        if which:
            sides[gait, which] = p
    label = max(labels, key=labels.__getitem__)
    side = None if label == NORMAL else max(SIDES, key=lambda s: sides[label, s])
    return Impairment(label, side, labels, sides)


def windows(
    walk: WalkCycles, frames: int, seconds: float = 4.0, step: float = 1.0
) -> list[tuple[int, WalkCycles]]:
    """(first frame, cycles) of each window that has LEAST_CYCLES or more.

    A window begins every `step` seconds and lasts `seconds`. frames: number of frames of the clip.
    """
    length = round(seconds * walk.fps)
    starts = range(0, max(frames - length, 0) + 1, max(1, round(step * walk.fps)))
    parts = ((start, walk.within(start, start + length)) for start in starts)
    return [(a, p) for a, p in parts if len(p) and len(p.right) + len(p.left) >= LEAST_CYCLES]
