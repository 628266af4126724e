"""The classifier of strong limps and the recogniser of mild limps, on left-out people and captured walks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from hobble.core.clip import Clip
from hobble.core.files import load_npz
from hobble.gait.comparison import compare_clip, healthy_profile, measure_clip
from hobble.gait.cycles import SCALARS
from hobble.gait.effect_sizes import EFFECTS, effects_of_people
from hobble.gait.features import features
from hobble.gait.limp_grade import PARTS, grade_walk, healthy_covariance, learn_grader
from hobble.gait.people import GAITS, NORMAL, read_people
from hobble.gait.profile import PROFILE_NAMES, mirror_profile, profile_of_walk
from hobble.gait.recogniser import SHRINKAGE, examples_of_people, learn, recognise, windows_with_cycles
from hobble.gait.signals import CURVES
from hobble.motion.edit import mirror_clip

NORMAL_WALKS = ("105_29", "105_31", "105_34", "105_36")


def limps(person: int, strength: float = 1.0) -> Iterator[tuple[str, str, dict, dict]]:
    """(gait, side, walk, healthy) of one person. strength: how far the walk is from normal to impaired."""
    healthy = dict(read_people().profile(NORMAL, person))
    for gait in GAITS[1:]:
        full = read_people().profile(gait, person)
        walk = {name: healthy[name] + strength * (full[name] - healthy[name]) for name in PROFILE_NAMES}
        yield gait, "right", walk, healthy
        yield gait, "left", mirror_profile(walk), mirror_profile(healthy)


@pytest.fixture(scope="module")
def left_out():
    """For each person, the classifier and the recogniser that were not trained on that person."""
    out = []
    for person in range(read_people().count):
        rest = [other for other in range(read_people().count) if other != person]
        judge = learn(*examples_of_people(read_people(), rest), shrinkage=SHRINKAGE)
        grader = learn_grader(read_people(), rest, healthy_covariance())
        out.append((lambda w, h, j=judge: recognise(w, h, j), grader.grade))
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


def test_people_left_out_are_near_the_known_walks_and_impossible_walks_are_far(left_out):
    near = [
        judges[1](walk, healthy).distance
        for person, judges in enumerate(left_out)
        for *_, walk, healthy in limps(person)
    ]
    assert max(near) < 1.5
    healthy = dict(read_people().normal_profile())
    where = ("mean trunk_forward", "mean knee_flexion_R", "mean knee_flexion_L")
    bent = {name: healthy[name] + 25 for name in where}
    assert grade_walk(healthy | bent, healthy).distance > 2


def test_strength_grows_with_the_limp():
    strengths = []
    for share in (0.3, 0.6, 1.0):
        graded = [grade_walk(walk, healthy) for *_, walk, healthy in limps(0, share)]
        strengths.append(np.mean([g.strength for g in graded if g.is_impaired]))
    assert strengths == sorted(strengths)
    assert strengths[0] < 0.6 < strengths[2]


def test_shuffled_labels_cannot_be_learnt():
    """With scrambled labels the measurements above give chance level."""
    values, classes = examples_of_people(read_people(), range(read_people().count))
    order = np.random.default_rng(3).permutation(len(classes))
    judge = learn(values[::2], [classes[i] for i in order[::2]], shrinkage=SHRINKAGE)
    right = np.mean(
        [a == b for a, b in zip(judge.likeliest_classes(values[1::2]), classes[1::2], strict=True)]
    )
    assert right < 0.4


def test_a_normal_walk_compared_with_another_persons_is_normal():
    everyone = range(read_people().count)
    pairs = [
        (read_people().profile(NORMAL, a), read_people().profile(NORMAL, b))
        for a in everyone
        for b in everyone
        if a != b
    ]
    assert np.mean([recognise(*pair).is_impaired for pair in pairs]) <= 0.03


def test_probabilities_sum_to_one_over_labels_and_their_sides():
    for judge in (recognise, grade_walk):
        for *_, walk, healthy in limps(1):
            said = judge(walk, healthy)
            assert sum(said.probabilities.values()) == pytest.approx(1)
            assert sum(said.probability_by_side.values()) == pytest.approx(1 - said.probabilities[NORMAL])
            assert said.probabilities[said.label] == max(said.probabilities.values())


def test_a_still_arm_and_a_leaning_trunk_are_recognised():
    healthy = dict(read_people().normal_profile())
    still = healthy | {"range arm_forward_L": 0.15 * healthy["range arm_forward_L"]}
    assert (grade_walk(still, healthy).label, grade_walk(still, healthy).side) == ("guarded_arm", "left")
    leaning = healthy | {"mean trunk_forward": healthy["mean trunk_forward"] + 12}
    said = grade_walk(leaning, healthy)
    assert (said.label, said.side, said.parts) == ("leaning_trunk", None, ("back",))


def test_slow_and_quick_even_walks_are_normal():
    """A change of speed alone is no limp, nor is a change that is equal on both sides."""
    healthy = dict(read_people().normal_profile())
    for speed, swing in ((0.55, 0.85), (1.6, 1.15)):
        walk = dict(healthy)
        walk["speed_per_leg"] *= speed
        walk["stride_seconds"] /= speed**0.5
        for name in (
            "step_R",
            "step_L",
            *(n for n in PROFILE_NAMES if n.startswith(("range hip_f", "range knee"))),
        ):
            walk[name] *= swing
        for name in ("range arm_forward_L", "range arm_forward_R"):
            walk[name] *= speed
        assert recognise(walk, healthy).label == NORMAL
        assert grade_walk(walk, healthy).label == NORMAL


def test_a_joint_that_is_still_in_the_healthy_walk_is_ignored():
    healthy = dict(read_people().normal_profile()) | {
        "range hip_abduction_L": 0.0,
        "range arm_forward_R": 0.0,
    }
    walk = healthy | {"range hip_abduction_L": 0.5, "range arm_forward_R": 2.0}
    assert np.abs(list(features(walk, healthy).values())).max() < 0.6
    assert recognise(walk, healthy).label == NORMAL


def test_effects_of_people_equal_the_documented_ones():
    known = effects_of_people(read_people())
    assert set(known) == set(GAITS[1:])
    antalgic = {name: mean for name, (mean, _) in known["antalgic"].items()}
    assert set(antalgic) == set(EFFECTS)
    assert antalgic["speed"] == pytest.approx(0.65, abs=0.01)
    assert antalgic["stance"] == pytest.approx(0.15, abs=0.01)  # .18 less the .03 of normal walks
    assert antalgic["step_hurt"] == pytest.approx(0.30, abs=0.01)
    assert antalgic["knee_hurt"] == pytest.approx(0.40, abs=0.02)
    assert known["stiff_legged"]["knee_hurt"][0] == pytest.approx(0.28, abs=0.02)
    assert antalgic["arm_hurt"] == pytest.approx(0.36, abs=0.03)


def test_the_statistics_of_people_have_no_gaps():
    known = read_people()
    assert known.profiles.shape == (6, 10, 52)
    assert known.curve_mean.shape == known.curve_spread.shape == (6, len(CURVES), 50)
    assert known.scalar_mean.shape == (6, len(SCALARS))
    knee, spread = known.curve("stiff_legged", "knee_flexion_R")
    assert np.ptp(knee) < 12 < np.ptp(known.curve(NORMAL, "knee_flexion_R")[0])
    assert spread.min() > 0
    assert known.scalar("antalgic", "step_R") == (
        pytest.approx(0.19, abs=0.01),
        pytest.approx(0.16, abs=0.01),
    )


def test_every_label_lists_its_parts_of_the_body():
    assert set(GAITS) < set(PARTS)


@pytest.mark.shared
def test_the_packages_statistics_are_derived_from_the_shared_curves(shared, tmp_path):
    from hobble.gait.derive_people import derive
    from hobble.gait.people import PEOPLE_FILE

    derive(shared / "reference" / "impaired_walks.npz", tmp_path / "people.npz")
    made, known = load_npz(tmp_path / "people.npz"), load_npz(PEOPLE_FILE)
    assert set(made) == set(known)
    for name, values in known.items():
        np.testing.assert_allclose(made[name].astype(float), values.astype(float), rtol=2e-3, atol=1e-4)


@pytest.fixture(scope="module")
def healthy_105(cmu):
    def get(without: str = "") -> dict[str, float]:
        return dict(healthy_profile([cmu(name) for name in NORMAL_WALKS if name != without]))

    return get


@pytest.mark.shared
@pytest.mark.parametrize("name", [*NORMAL_WALKS, "105_02", "105_10", "105_17", "105_22", "105_27"])
def test_normal_slow_and_quick_walks_of_the_cmu_database_are_normal(cmu, healthy_105, name):
    seen = compare_clip(cmu(name), healthy_105(without=name))
    assert seen.answer.label == NORMAL
    assert not seen.grade.is_impaired
    assert not any(answer.is_impaired for _, answer in seen.window_answers)
    for side in ("right", "left"):
        assert abs(seen.effects[side]["stance"]) < 0.06
        assert 0.8 < seen.effects[side]["knee_hurt"] < 1.2


@pytest.mark.shared
def test_a_leg_that_is_dragged_is_antalgic_on_its_side(cmu, healthy_105):
    seen = compare_clip(cmu("105_25"), healthy_105())
    for said in (seen.answer, seen.grade):
        assert (said.label, said.side) == ("antalgic", "right")
    assert seen.answer_shares() == seen.grade_shares() == {"antalgic right": 1.0}
    sizes = seen.effects["right"]
    assert sizes["stance"] > 0.2
    assert sizes["step_hurt"] < 0.3
    assert sizes["knee_hurt"] < 0.5
    assert sizes["speed"] < 0.65


@pytest.mark.shared
def test_a_mirrored_limp_of_the_right_leg_is_one_of_the_left(cmu):
    def seen_in_it(name: str) -> Clip:
        return mirror_clip(cmu(name), f"{name}_mirror")

    seen = compare_clip(seen_in_it("105_25"), healthy_profile([seen_in_it(name) for name in NORMAL_WALKS]))
    assert seen.answer_shares() == seen.grade_shares() == {"antalgic left": 1.0}


@pytest.mark.shared
@pytest.mark.parametrize("pace", [0.6, 0.8, 1.5])
def test_a_healthy_walk_played_slower_or_faster_is_normal(cmu, healthy_105, pace):
    clip = cmu("105_31")
    seen = compare_clip(replace(clip, fps=clip.fps * pace), healthy_105(without="105_31"))
    assert seen.answer.label == seen.grade.label == NORMAL
    assert seen.effects["right"]["speed"] == pytest.approx(pace, rel=0.15)


@pytest.mark.shared
def test_a_hurt_stomach_is_recognised_as_a_leaning_trunk(cmu, healthy_105):
    seen = compare_clip(cmu("105_26"), healthy_105())
    assert (seen.grade.label, seen.grade.parts) == ("leaning_trunk", ("back",))
    assert seen.effects["right"]["lean"] > 8


@pytest.mark.shared
@pytest.mark.parametrize(
    ("name", "side", "part"),
    [
        ("Injured_Walk_RUL_extended_converted", "right", "thigh"),
        ("Injured_Walk_LLL_extended_converted", "left", "shank"),
    ],
)
def test_the_clips_of_ferre_are_limps_of_the_leg_that_was_hurt(cmu, healthy_105, name, side, part):
    """They are compared with another walker's healthy walks, because the performers' own are missing."""
    seen = compare_clip(cmu(name), healthy_105())
    assert seen.answer.side == seen.grade.side == side
    assert part in seen.grade.parts


@pytest.mark.shared
def test_windows_of_a_clip_hold_enough_cycles(cmu):
    clip = cmu("105_29")
    walk = measure_clip(clip)
    parts = windows_with_cycles(walk, len(clip), seconds=3)
    assert parts
    for start, part in parts:
        cycles = part.right + part.left
        assert len(cycles) >= 3
        assert all(start <= cycle.start and cycle.end <= start + 180 for cycle in cycles)
        assert profile_of_walk(part)["stride_seconds"] == pytest.approx(1.3, abs=0.2)
