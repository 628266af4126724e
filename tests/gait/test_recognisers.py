"""The classifier of strong limps and the recogniser of mild limps, on left-out people and captured walks."""

from collections.abc import Iterator

import numpy as np
import pytest

from hobble.gait.profile import (
    EFFECTS,
    GAITS,
    NORMAL,
    PROFILE_NAMES,
    effects_of_people,
    healthy_profile,
    mirror_profile,
    read_people,
)
from hobble.gait.recognise import (
    PARTS,
    SHRINKAGE_OF_PEOPLE,
    compare_clip,
    examples_of_people,
    grade_walk,
    learn,
    learn_grader,
    recognise,
    shares_of_answers,
)

NORMAL_WALKS = ("105_29", "105_31", "105_34", "105_36")
PEOPLE = range(10)


def limps(person: int, strength: float = 1.0) -> Iterator[tuple[str, str, dict, dict]]:
    """(gait, side, walk, healthy) of one person. strength: how far the walk is from normal to impaired."""
    healthy = dict(read_people()[person][NORMAL])
    for gait in GAITS[1:]:
        full = read_people()[person][gait]
        walk = {name: healthy[name] + strength * (full[name] - healthy[name]) for name in PROFILE_NAMES}
        yield gait, "right", walk, healthy
        yield gait, "left", mirror_profile(walk), mirror_profile(healthy)


@pytest.fixture(scope="module")
def left_out():
    """For each person, the classifier and the recogniser that were not trained on that person."""
    out = []
    for person in PEOPLE:
        rest = [other for other in PEOPLE if other != person]
        judge = learn(*examples_of_people(rest), shrinkage=SHRINKAGE_OF_PEOPLE)
        out.append((lambda w, h, j=judge: recognise(w, h, j), learn_grader(rest).grade))
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
            assert said.probabilities[said.label] == max(said.probabilities.values())
    assert right >= 0.9 * 100
    assert impaired >= 0.95 * 100


def test_mild_limps_are_recognised_by_the_graded_recogniser(left_out):
    found = np.zeros(2)
    for person, judges in enumerate(left_out):
        for *_, side, walk, healthy in limps(person, 0.5):
            found += [judge(walk, healthy).is_impaired for judge in judges]
            assert judges[1](walk, healthy).side in (None, side)
    assert found[0] < found[1]
    assert found[1] >= 0.75 * 100


def test_limps_without_an_example_and_impossible_walks():
    healthy = dict(healthy_profile([]))
    still = healthy | {"range arm_forward_L": 0.15 * healthy["range arm_forward_L"]}
    assert grade_walk(still, healthy).name == "guarded_arm left"
    leaning = healthy | {"mean trunk_forward": healthy["mean trunk_forward"] + 12}
    said = grade_walk(leaning, healthy)
    assert (said.label, said.side, said.parts) == ("leaning_trunk", None, ("back",))
    where = ("mean trunk_forward", "mean knee_flexion_R", "mean knee_flexion_L")
    assert grade_walk(healthy | {name: healthy[name] + 25 for name in where}, healthy).distance > 2


def test_effects_of_people_equal_the_documented_ones():
    known = effects_of_people()
    assert set(known) == set(GAITS[1:]) < set(PARTS)
    antalgic = {name: mean for name, (mean, _) in known["antalgic"].items()}
    assert set(antalgic) == set(EFFECTS)
    assert antalgic["speed"] == pytest.approx(0.65, abs=0.01)
    assert antalgic["stance"] == pytest.approx(0.15, abs=0.01)  # .18 less the .03 of normal walks
    assert antalgic["step_hurt"] == pytest.approx(0.30, abs=0.01)
    assert known["stiff_legged"]["knee_hurt"][0] == pytest.approx(0.28, abs=0.02)


@pytest.fixture(scope="module")
def healthy_105(cmu):
    def get(without: str = "") -> dict[str, float]:
        return dict(healthy_profile([cmu(name) for name in NORMAL_WALKS if name != without]))

    return get


@pytest.mark.shared
@pytest.mark.parametrize("name", ["105_31", "105_36", "105_02", "105_17", "105_27"])
def test_normal_slow_and_quick_walks_of_the_cmu_database_are_normal(cmu, healthy_105, name):
    seen = compare_clip(cmu(name), healthy_105(without=name))
    assert seen.answer.label == NORMAL
    assert not seen.grade.is_impaired
    assert not any(answer.is_impaired for answer in seen.window_answers)
    for side in ("right", "left"):
        assert abs(seen.effects[side]["stance"]) < 0.06
        assert 0.8 < seen.effects[side]["knee_hurt"] < 1.2


@pytest.mark.shared
def test_a_leg_that_is_dragged_is_antalgic_on_its_side(cmu, healthy_105):
    seen = compare_clip(cmu("105_25"), healthy_105())
    assert seen.answer.name == seen.grade.name == "antalgic right"
    for answers in (seen.window_answers, seen.window_grades):
        assert shares_of_answers(answers) == {"antalgic right": 1.0}
    sizes = seen.effects["right"]
    assert sizes["stance"] > 0.2
    assert sizes["step_hurt"] < 0.3
    assert sizes["knee_hurt"] < 0.5
    assert sizes["speed"] < 0.65


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
    seen = compare_clip(cmu(name), healthy_105())
    assert seen.grade.side == side
    assert part in seen.grade.parts
    assert side is None or seen.answer.side == side
