"""Recognises the windows of each captured person after learning from all other people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hobble.core.quat import Array
from hobble.gait.discriminant import learn
from hobble.measures.manners.results import LeftOut
from hobble.measures.manners.windows import NONE, MannerWindow, table

# Shrinkages of the covariance towards its diagonal. The one that names most windows of left-out people right
# is used. A larger one is better if there are fewer clips: .6 recognises 69 % of moods (few clips) and 51 %
# of diagnoses (many clips); .02 recognises 54 % of moods and 63 % of diagnoses.
SHRINKAGES = (0.02, 0.1, 0.3, 0.6)


def left_out(
    windows: Sequence[MannerWindow], people: Mapping[str, str], shrinkages: Sequence[float] = SHRINKAGES
) -> LeftOut:
    """Recognise the windows of each person (or clip, with its mirror) after learning from all others.

    people: clip -> person. The result is for the shrinkage that names most windows right; if several do, for
    the largest. In the result, people: number of persons. people_of: number of persons with each manner.
    right, by_manner: share of windows named right, of all and of each manner. presence_right: share of
    windows in which the recogniser says correctly whether there is any manner. A manner that only one person
    has is never recognised, because it cannot be learnt while this person is left out.
    """
    values = table(windows)
    manner, person = (
        np.array(one) for one in ([w.manner for w in windows], [people[w.clip] for w in windows])
    )
    tried = [_with_shrinkage(values, manner, person, shrinkage) for shrinkage in shrinkages]
    return max(tried, key=lambda one: (one["right"] or 0.0, one["shrinkage"]))


def _with_shrinkage(values: Array, manner: np.ndarray, person: np.ndarray, shrinkage: float) -> LeftOut:
    """The result for one shrinkage. values: (n, D). manner, person: (n,) text."""
    named = np.full(len(manner), "", object)  # "": nothing could be learnt from the others
    for one in np.unique(person):
        own = person == one
        if len(set(manner[~own])) > 1:
            named[own] = learn(values[~own], manner[~own].tolist(), shrinkage).names(values[own])
    tried = named != ""
    right, presence = named == manner, (named == NONE) == (manner == NONE)
    owners = sorted(set(zip(manner.tolist(), person.tolist(), strict=True)))
    return {
        "shrinkage": shrinkage,
        "people": len(set(person)),
        "people_of": {str(m): sum(m == of for of, _ in owners) for m in sorted(set(manner))},
        "windows": int(tried.sum()),
        "right": share(right[tried]),
        "by_manner": {str(m): share(right[tried & (manner == m)]) for m in sorted(set(manner[tried]))},
        "presence_right": share(presence[tried]),
    }


def share(right: Sequence[bool] | np.ndarray) -> float | None:
    """The share of values that are true, 0 to 1; None if there are no values."""
    return round(float(np.mean(right)), 5) if len(right) else None
