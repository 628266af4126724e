"""Cycles and their numbers, on walkers whose steps, stances and angles are known exactly."""

import numpy as np
import pytest

from hobble.gait.cycles import CURVES, SAMPLES, measure_cycles
from tests.gait.conftest import CYCLE, LEG, Stepper, Swinger


def test_landings_stances_and_steps_of_a_made_walk_are_found(holden31):
    made = Stepper(stance_right=30, stance_left=42, ahead_right=10, ahead_left=30, left_lands=24)
    walk = measure_cycles(holden31, made.positions(holden31))
    # the ends of a clip are no landings: what the ankle did beyond is not known
    assert [cycle.start for cycle in walk.right] == [60, 120, 180, 240]
    assert [cycle.start for cycle in walk.left] == [24, 84, 144, 204, 264]
    for cycle in walk.right:
        assert cycle.end - cycle.start == CYCLE
        scalars = cycle.scalars
        assert scalars["stride_seconds"] == 1.0
        assert scalars["speed_per_leg"] == pytest.approx(90 / LEG)
        assert scalars["left_strike_phase"] == 24 / 60
        # A foot that stands from its landing to 30 frames later moves in the first and the last of them.
        assert scalars["stance_share_R"] == pytest.approx(29 / 60, abs=0.6 / 60)
        assert scalars["stance_share_L"] == pytest.approx(41 / 60, abs=0.6 / 60)
        left_then = made.relative("left", np.array(0))
        right_then = made.relative("right", np.array(24))
        assert scalars["step_R"] == pytest.approx((10 - left_then) / LEG)
        assert scalars["step_L"] == pytest.approx((30 - right_then) / LEG)
        assert scalars["step_width"] == pytest.approx(18 / LEG)


# Curve -> its mean and its range.
MADE = {
    "hip_flexion_R": (2, 28), "hip_flexion_L": (5, 40), "knee_flexion_R": (8, 16), "knee_flexion_L": (20, 40),
    "hip_abduction_R": (0, 0), "arm_forward_R": (1, 10), "arm_forward_L": (-4, 34), "trunk_left": (3, 8),
    "elbow_flexion_R": (20, 0), "trunk_forward": (5, 4), "pelvis_left_up": (6, 0), "pelvis_turn_left": (0, 0),
    "shoulders_turn_left": (0, 0), "foot_pitch_L": (-17.10273, 0), "hips_height": (72 / LEG, 0),
}  # fmt: skip


def test_curves_of_a_made_walk_have_its_means_and_ranges(holden31):
    made = Swinger(
        hip={"right": (2.0, 14.0), "left": (5.0, 20.0)},
        knee={"right": 16.0, "left": 40.0},
        arm={"right": (1.0, 5.0), "left": (-4.0, 17.0)},
    )
    for cycle in measure_cycles(holden31, made.positions(holden31)).right:
        for name, (mean, whole) in MADE.items():
            curve = cycle.curves[CURVES.index(name)]
            assert curve.shape == (SAMPLES,)
            assert np.ptp(curve) == pytest.approx(whole, abs=1e-6), name
            assert curve.mean() == pytest.approx(mean, abs=1e-5), name


def test_cycles_do_not_depend_on_place_size_and_direction(holden31):
    positions = Stepper(ahead_left=35).positions(holden31)
    turn = np.radians(130)
    rotation = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    moved = 1.3 * positions @ rotation.T + [500, 0, -300]
    for a, b in zip(
        measure_cycles(holden31, positions).right, measure_cycles(holden31, moved).right, strict=True
    ):
        assert (a.start, a.end) == (b.start, b.end)
        assert a.scalars == pytest.approx(b.scalars)
        np.testing.assert_allclose(a.curves, b.curves, atol=1e-6)


PARTS = slice(None, None, -1), slice(20), slice(1)  # backward, and too short


def standing(positions):
    return positions - [0, 0, 1.5] * np.arange(len(positions))[:, None, None]


@pytest.mark.parametrize("change", [standing, *(lambda p, s=s: p[s] for s in PARTS)])
def test_only_straight_walking_has_cycles(holden31, change):
    assert len(measure_cycles(holden31, change(Stepper().positions(holden31)))) == 0
