"""Which impairment a walk looks like, of those that people showed, and on which side.

A linear classifier of people's walks, each against that person's own normal walk, with either leg impaired: the left one
is the right one in a mirror. Neither speed nor stride time is a feature, and most features compare the two sides,
since a healthy walk changes with its speed but stays even.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from hobble.core.quat import Array
from hobble.gait.cycles import Walk
from hobble.gait.discriminant import Discriminant, learn
from hobble.gait.people import GAITS, NORMAL, People, people
from hobble.gait.profile import Profile, mirrored, profile

SHRINKAGE = 0.2  # of the covariance towards its diagonal: 110 examples for some twenty features
LEAST_CYCLES = 2  # of each leg in a window that is judged
RIGHT, LEFT = "right", "left"
SIDES = (RIGHT, LEFT)


@dataclass(frozen=True)
class Answer:
    """What a walk is called.

    label: one of people.GAITS. side: of the impaired leg, None where the label is normal. probabilities: of
    each label, both sides together; they sum to 1. sides: of each impairment and side, such as
    ("antalgic", "right").
    """

    label: str
    side: str | None
    probabilities: Mapping[str, float] = field(repr=False)
    sides: Mapping[tuple[str, str], float] = field(repr=False)

    @property
    def impaired(self) -> bool:
        """Whether some impairment is likelier than none."""
        return self.probabilities[NORMAL] < 0.5


def features(walk: Profile, healthy: Profile) -> dict[str, float]:
    """What tells the impairments apart: a walk against the same walker's healthy one.

    Degrees, leg lengths, shares of the cycle and, of ranges, shares of the healthy range.
    """

    def change(name: str) -> float:
        return walk[name] - healthy[name]

    def share(name: str) -> float:
        return walk[f"range {name}"] / max(healthy[f"range {name}"], 1e-6)

    out = {
        "stance L - R": change("stance_share_L") - change("stance_share_R"),
        "left landing": change("left_strike_phase"),
        "step R - L": change("step_R") - change("step_L"),
        "step width": change("step_width"),
    }
    for part in ("knee_flexion", "hip_flexion", "hip_abduction", "arm_forward", "ankle_height"):
        out[f"range {part} R - L"] = share(f"{part}_R") - share(f"{part}_L")
    for part in ("knee_flexion", "hip_flexion", "hip_abduction"):
        out |= {f"mean {part} {side}": change(f"mean {part}_{side}") for side in "RL"}
    for part in ("trunk_forward", "trunk_left", "pelvis_left_up"):
        out |= {f"{kind} {part}": change(f"{kind} {part}") for kind in ("range", "mean")}
    return out


def examples(known: People, whose: Iterable[int]) -> tuple[Array, list[str]]:
    """Features (n, D) and classes of the walks of some people, each with the right and with the left impaired.

    A class is "normal", or "antalgic right" and so on.
    """
    values, classes = [], []
    for person in whose:
        healthy = known.profile(NORMAL, person)
        for gait in GAITS:
            walk = known.profile(gait, person)
            for side, w, h in ((RIGHT, walk, healthy), (LEFT, mirrored(walk), mirrored(healthy))):
                values.append(list(features(w, h).values()))
                classes.append(gait if gait == NORMAL else f"{gait} {side}")
    return np.array(values), classes


@cache
def classifier() -> Discriminant:
    """Learnt from all people that the package knows."""
    return learn(*examples(people(), range(people().count)), shrinkage=SHRINKAGE)


def recognise(walk: Profile, healthy: Profile, judge: Discriminant | None = None) -> Answer:
    """What the walk of a figure is called beside its healthy walk."""
    judge = judge or classifier()
    scores = judge.scores(np.array([list(features(walk, healthy).values())]))[0]
    likely = np.exp(scores - scores.max())
    likely /= likely.sum()
    sides, labels = {}, dict.fromkeys(GAITS, 0.0)
    for name, p in zip(judge.classes, map(float, likely), strict=True):
        gait, _, side = name.partition(" ")
        labels[gait] += p
        if side:
            sides[gait, side] = p
    label = max(labels, key=labels.__getitem__)
    side = None if label == NORMAL else max(SIDES, key=lambda s: sides[label, s])
    return Answer(label, side, labels, sides)


def recognise_windows(
    walk: Walk, healthy: Profile, frames: int, seconds: float = 4.0, step: float = 1.0
) -> list[tuple[int, Answer]]:
    """What each window of a walk is called: (first frame, answer) of those with at least LEAST_CYCLES cycles.

    frames: of the clip; windows begin every `step` seconds and last `seconds`.
    """
    long = round(seconds * walk.fps)
    out = []
    for start in range(0, max(frames - long, 0) + 1, max(1, round(step * walk.fps))):
        part = walk.within(start, start + long)
        if len(part) >= LEAST_CYCLES:
            out.append((start, recognise(profile(part), healthy)))
    return out


def impaired_share(answers: Sequence[tuple[int, Answer]]) -> float:
    """Share of windows that are called impaired."""
    return float(np.mean([answer.impaired for _, answer in answers])) if answers else float("nan")
