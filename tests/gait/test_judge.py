"""Limps beside those of real people: people's own limps, and limps with a fault that no people have."""

from dataclasses import replace

import pytest

from hobble.gait import judge
from hobble.gait.judge import Limp
from hobble.gait.profile import GAITS, NORMAL, read_people

PARTS = ("hip", "thigh", "shank", "foot")


def limps_of(people, **changed: float) -> list[Limp]:
    """Four limps of some of the ten people, as if each were one of a figure. changed: profile -> addition."""
    found = []
    for person in (read_people()[number] for number in people):
        for part, gait in zip(PARTS, GAITS[1:], strict=False):
            walk = {**person[gait]}
            for name, amount in changed.items():
                walk[name.replace("__", " ")] += amount
            found.append(Limp(part, 10.0, 0.6, walk, person[NORMAL]))
    return found


def test_limps_of_people_are_like_people_and_a_strange_hip_is_not():
    own, strange = limps_of([0, 2, 4, 6]), limps_of([0, 2, 4, 6], mean__hip_abduction_L=12.0)
    assert max(limp.nearest for limp in own) == pytest.approx(0)
    assert min(limp.nearest for limp in strange) > 0.7
    assert judge.area_under_curve(own) < 0.65
    assert judge.area_under_curve(strange) > 0.9
    assert not any(each.counts for each in judge.beyond_people(own))
    (found,) = (each for each in judge.beyond_people(strange) if each.counts)
    assert found.feature == "mean hip_abduction L"
    assert found.by > judge.most_of_people()
    assert min(found.groups) <= found.value - 12.0 <= max(found.groups) + 1


def test_one_in_twenty_features_of_left_out_people_counts():
    """So a figure of which none counts is as ordinary as the most ordinary person."""
    counted = judge.counted_of_people()
    assert counted.sum() == pytest.approx(0.05 * 10 * 28, abs=1)
    assert counted.min() == 0
    names = list(judge.numbers(*2 * (read_people()[0][NORMAL],)))
    assert [list(group) for group in judge.groups().values()] == [names, names]


def test_strength_and_distance_are_those_of_the_changed_features():
    first, *_ = limps_of([0])
    assert replace(first, walk=first.healthy).strength == 0
    assert first.apart(first) == 0
    assert first.apart(replace(first, walk=first.healthy)) == pytest.approx(first.strength)
