"""Recognises the manner (mood or diagnosis) of each captured person after learning from all other people.

The recogniser judges windows, which are stretches of walking of one second.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from hobble.core.quat import Array
from hobble.gait.discriminant import learn
from hobble.measures.manners.results import LeftOut
from hobble.measures.manners.windows import NONE, MannerWindow, feature_table

# The recogniser shrinks the covariance of the features towards its diagonal by one of these shares (0 to 1).
# All are tried. A large share is better if there are few clips: .6 recognises 69 % of moods (few clips) and
# 51 % of diagnoses (many clips); .02 recognises 54 % of moods and 63 % of diagnoses.
SHRINKAGES = (0.02, 0.1, 0.3, 0.6)


def recognise_left_out(
    windows: Sequence[MannerWindow], people: Mapping[str, str], shrinkages: Sequence[float] = SHRINKAGES
) -> LeftOut:
    """Recognise the manner in each person's windows after learning from the windows of all other people.

    people: clip -> person. shrinkages: the shares to try, see SHRINKAGES. The result is for the shrinkage
    with which most windows are named right. If several are equally good, it is for the largest of them. A
    manner that only one person has is never recognised, because it cannot be learnt while this person is left
    out.
    """
    values = feature_table(windows)
    manner, person = (
        np.array(names) for names in ([w.manner for w in windows], [people[w.clip] for w in windows])
    )
    results = [_recognise_with_shrinkage(values, manner, person, shrinkage) for shrinkage in shrinkages]
    return max(results, key=lambda result: (result["right"] or 0.0, result["shrinkage"]))


def _recognise_with_shrinkage(
    values: Array, manner: np.ndarray, person: np.ndarray, shrinkage: float
) -> LeftOut:
    """The result for one shrinkage.

    values: (n, D) features of n windows. manner, person: (n,) names of each window's manner and person.
    """
    named = np.full(len(manner), "", object)  # "": the other people have fewer than two manners
    for left_out_person in np.unique(person):
        out = person == left_out_person
        if len(set(manner[~out])) > 1:
            named[out] = learn(values[~out], manner[~out].tolist(), shrinkage).likeliest_classes(values[out])
    tried = named != ""
    right, presence_right = named == manner, (named == NONE) == (manner == NONE)
    pairs = sorted(set(zip(manner.tolist(), person.tolist(), strict=True)))
    return {
        "shrinkage": shrinkage,
        "people": len(set(person)),
        "people_of": {str(m): sum(m == other for other, _ in pairs) for m in sorted(set(manner))},
        "windows": int(tried.sum()),
        "right": share_of_true(right[tried]),
        "by_manner": {
            str(m): share_of_true(right[tried & (manner == m)]) for m in sorted(set(manner[tried]))
        },
        "presence_right": share_of_true(presence_right[tried]),
    }


def share_of_true(right: Sequence[bool] | np.ndarray) -> float | None:
    """The share of values that are true, 0 to 1 with five decimals; None if there are no values."""
    return round(float(np.mean(right)), 5) if len(right) else None
