"""The classifier of strong limps and the recogniser of mild limps, on left-out people and captured walks."""

from collections.abc import Iterator

import numpy as np
import pytest

from hobble.gait import profile
from hobble.gait import recognise as module
from hobble.gait.profile import GAITS, NORMAL, PROFILE_NAMES

NORMAL_WALKS = ("105_29", "105_31", "105_34", "105_36")
PEOPLE = range(10)


def limps(person: int, strength: float = 1.0) -> Iterator[tuple[str, str, dict, dict]]:
    """(gait, side, walk, healthy) of one person. strength: how far the walk is from normal to impaired."""
    healthy = dict(profile.read_people()[person][NORMAL])
    for gait in GAITS[1:]:
        full = profile.read_people()[person][gait]
        walk = {name: healthy[name] + strength * (full[name] - healthy[name]) for name in PROFILE_NAMES}
        yield gait, "right", walk, healthy
        yield gait, "left", profile.mirror_profile(walk), profile.mirror_profile(healthy)


@pytest.fixture(scope="module")
def left_out():
    """For each person, the classifier and the recogniser that were not trained on that person."""
    out = []
    for person in PEOPLE:
        rest = [other for other in PEOPLE if other != person]
        judge = module.learn(*module.examples_of_people(rest), shrinkage=module.SHRINKAGE_OF_PEOPLE)
        out.append((lambda w, h, j=judge: module.recognise(w, h, j), module.learn_grader(rest).grade))
    return out


@pytest.mark.parametrize("which", [0, 1], ids=["linear", "graded"])
def test_people_left_out_of_the_training_are_recognised(left_out, which):
    right = impaired = 0.0
    for person, judges in enumerate(left_out):
        for gait, side, walk, healthy in limps(person):
            said = judges[which](walk, healthy)
            right += (said.label, said.side) == (gait, side)
            impaired += said.is_impaired
            assert said.side in (None, side)
            assert not which or said.distance < 1.5
            assert sum(said.probabilities.values()) == pytest.approx(1)
            assert sum(said.probability_by_side.values()) == pytest.approx(1 - said.probabilities[NORMAL])
    assert right >= 0.9 * 100
    assert impaired >= 0.95 * 100


def test_mild_limps_are_recognised_by_the_graded_recogniser(left_out):
    found = np.zeros(2)
    for person, judges in enumerate(left_out):
        for _, side, walk, healthy in limps(person, 0.5):
            linear, graded = (judge(walk, healthy) for judge in judges)
            found += linear.is_impaired, graded.is_impaired
            assert graded.side in (None, side)
    assert found[0] < found[1]
    assert found[1] >= 0.75 * 100


def test_limps_without_an_example_and_impossible_walks():
    healthy = dict(profile.healthy_profile([]))
    still = healthy | {"range arm_forward_L": 0.15 * healthy["range arm_forward_L"]}
    assert module.grade_walk(still, healthy).name == "guarded_arm left"
    leaning = healthy | {"mean trunk_forward": healthy["mean trunk_forward"] + 12}
    said = module.grade_walk(leaning, healthy)
    assert (said.label, said.side, said.parts) == ("leaning_trunk", None, ("back",))
    where = ("mean trunk_forward", "mean knee_flexion_R", "mean knee_flexion_L")
    assert module.grade_walk(healthy | {name: healthy[name] + 25 for name in where}, healthy).distance > 2


@pytest.fixture(scope="module")
def healthy_105(cmu):
    def get(without: str = "") -> dict[str, float]:
        return dict(profile.healthy_profile([cmu(name) for name in NORMAL_WALKS if name != without]))

    return get


@pytest.mark.shared
@pytest.mark.parametrize("name", ["105_31", "105_36", "105_02", "105_17", "105_27"])
def test_normal_slow_and_quick_walks_of_the_cmu_database_are_normal(cmu, healthy_105, name):
    seen = module.compare_clip(cmu(name), healthy_105(without=name))
    assert seen.answer.label == NORMAL
    assert not any(answer.is_impaired for answer in (seen.grade, *seen.window_answers))
    for effects in seen.effects.values():
        assert abs(effects["stance"]) < 0.06
        assert 0.8 < effects["knee_hurt"] < 1.2


@pytest.mark.shared
def test_a_leg_that_is_dragged_is_antalgic_on_its_side(cmu, healthy_105):
    seen = module.compare_clip(cmu("105_25"), healthy_105())
    assert seen.answer.name == seen.grade.name == "antalgic right"
    for answers in (seen.window_answers, seen.window_grades):
        assert module.shares_of_answers(answers) == {"antalgic right": 1.0}
    sizes = seen.effects["right"]
    assert sizes["stance"] > 0.2
    assert max(sizes["step_hurt"] / 0.3, sizes["knee_hurt"] / 0.5, sizes["speed"] / 0.65) < 1


@pytest.mark.shared
@pytest.mark.parametrize(
    ("name", "side", "part"),
    [
        ("105_26", None, "back"),  # a hurt stomach
        # Compared with another walker's healthy walks, because the performers' own are missing.
        ("Injured_Walk_RUL_extended_converted", "right", "thigh"),
        ("Injured_Walk_LLL_extended_converted", "left", "shank"),
    ],
)
def test_captured_limps_are_recognised(cmu, healthy_105, name, side, part):
    seen = module.compare_clip(cmu(name), healthy_105())
    assert seen.grade.side == side
    assert part in seen.grade.parts
    assert side is None or seen.answer.side == side
