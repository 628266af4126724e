"""The numbers of a walk, and those of its mirror image."""

import runpy

import numpy as np
import pytest

from hobble.gait import profile
from hobble.gait.cycles import measure_cycles
from hobble.gait.profile import measure_effects, mirror_profile, profile_of_walk
from hobble.gait.recognise import grade_walk, recognise
from tests.gait.conftest import Swinger


@pytest.fixture(scope="module")
def uneven(holden31):
    """A limp of the right leg with a little noise in every joint, so that no two values are equal."""
    made = Swinger(
        hip={"right": (-6.0, 11.0), "left": (5.0, 20.0)},
        knee={"right": 14.0, "left": 40.0},
        arm={"right": (1.0, 5.0), "left": (-4.0, 17.0)},
        trunk_forward=(9.0, 3.0),
        pelvis_left_up=-4.0,
    )
    positions = made.positions(holden31)
    return positions + np.random.default_rng(1).normal(0, 0.3, positions.shape)


@pytest.fixture(scope="module")
def healthy(holden31):
    even = {"left": (3.0, 20.0), "right": (3.0, 20.0)}
    made = Swinger(hip=even, knee={"left": 40.0, "right": 40.0}, arm=even, pelvis_left_up=0.0)
    return profile_of_walk(measure_cycles(holden31, made.positions(holden31)))


def test_the_mirrored_clip_has_the_mirrored_profile_and_the_effects_of_the_other_side(
    holden31, uneven, healthy
):
    mirror = uneven[:, holden31.mirror_joints] * [-1.0, 1.0, 1.0]
    own, other = (profile_of_walk(measure_cycles(holden31, positions)) for positions in (uneven, mirror))
    assert other == pytest.approx(mirror_profile(own), abs=1e-9)
    assert other["range knee_flexion_L"] == pytest.approx(own["range knee_flexion_R"])
    assert other["range knee_flexion_L"] < 0.6 * other["range knee_flexion_R"]
    mirrored = mirror_profile(healthy)
    effects = measure_effects(own, healthy, "right")
    assert effects == pytest.approx(measure_effects(other, mirrored, "left"))
    for judge in (recognise, grade_walk):
        one, two = judge(own, healthy), judge(other, mirrored)
        assert (one.label, one.side, two.side) == (two.label, "right", "left")
        assert two.probabilities == pytest.approx(one.probabilities, abs=1e-6)


def test_effects_of_a_made_limp_are_found(holden31, healthy):
    even = (3.0, 20.0)
    made = Swinger(
        hip={"right": (3.0, 15.0), "left": even},
        knee={"right": 10.0, "left": 40.0},
        arm={"right": (3.0, 5.0), "left": even},
        trunk_forward=(9.0, 2.0),
        trunk_left=(0.0, 4.0),
        pelvis_left_up=-2.0,
    )
    sizes = measure_effects(profile_of_walk(measure_cycles(holden31, made.positions(holden31))), healthy)
    expected = {"knee_hurt": 0.25, "knee_sound": 1.0, "hip_hurt": 0.75, "arm_hurt": 0.25, "arm_sound": 1.0}
    # From 3 degrees to the left to none: towards the right.
    expected |= {"lean_forward": 4.0, "lean_hurt": 3.0, "lean": 5.0, "pelvis_drop": 2.0}
    assert {name: sizes[name] for name in expected} == pytest.approx(expected)


def test_peoples_mean_curves_agree_with_their_profiles():
    for gait, curves in profile.mean_curves().items():
        people = profile.mean_profile(gait)
        for name, curve in curves.items():
            assert curve.mean() == pytest.approx(people[f"mean {name}"], abs=0.005)
            # People are not in step, so the range of their mean is smaller than the mean of their ranges.
            assert 0.4 < np.ptp(curve) / people[f"range {name}"] < 1


@pytest.mark.shared
def test_the_file_of_people_comes_from_the_recordings(root, shared, tmp_path):
    derive = runpy.run_path(str(root / "benchmarks/derive_gait.py"))["derive_people"]
    derive(shared / "reference/impaired_walks.npz", tmp_path / "people.npz")
    assert (tmp_path / "people.npz").read_bytes() == profile.PEOPLE_FILE.read_bytes()
