"""Feet stand on the ground under them, and raise the heel or the body where a leg cannot reach."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.skeleton import Skeleton
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.feet import (
    BODY_FREE,
    FLOATING,
    STRETCH,
    carry_body,
    foot_parts,
    leg_joints,
    rest_facing,
)
from tests.runtime.one_figure import Feet, crouched


def stretched(position: np.ndarray, legs: np.ndarray) -> float:
    """Distance from hip to heel joint of the left leg, as a share of its length."""
    hip, knee, heel, _ = position[legs[0]]
    return np.linalg.norm(heel - hip) / (np.linalg.norm(knee - hip) + np.linalg.norm(heel - knee))


def test_the_heel_of_a_held_foot_rises_before_its_leg_is_straight(holden31: Skeleton) -> None:
    """As the body goes on, the toe stays, the knee stays bent, and the foot turns about the toe, rigid."""
    feet = Feet(holden31, 0.05, 0.35)
    _, _, heel, toe = feet.legs[0]
    start, turns = feet.base[0], feet.base[1]
    foot, first = start[toe] - start[heel], start[toe]
    leg = sum(np.linalg.norm(start[a] - start[b]) for a, b in itertools.pairwise(feet.legs[0][:3]))
    rolls, lengths = [], []
    for z in np.arange(0, 16, 0.5):
        shown = feet(np.array([0.0, 0, z]), 1.0)
        np.testing.assert_allclose(shown[toe], first, atol=1e-6)
        turned = quat.mul(feet.rotation[heel], quat.inv(turns[heel]))
        np.testing.assert_allclose(shown[toe] - shown[heel], quat.rotate(turned, foot), atol=1e-6)
        np.testing.assert_array_equal(feet.rotation[toe], turns[toe])
        rolls.append(2 * np.degrees(np.arcsin(np.linalg.norm(turned[1:]))))
        lengths.append(stretched(shown, feet.legs))
    assert rolls[0] == 0
    assert rolls[-1] > 10
    assert 0 <= np.diff(rolls).min() <= np.diff(rolls).max() < 1.5  # it does not set in at once
    assert lengths[-1] == pytest.approx(STRETCH, abs=1e-9)
    without = np.linalg.norm(first - [0, 0, 15.5] - foot - start[feet.legs[0][0]]) / leg
    assert without > lengths[-1] + 0.005


def test_feet_are_lifted_out_of_the_ground(holden31: Skeleton) -> None:
    feet = Feet(holden31)
    toe, heel = holden31.role("left_toe"), holden31.role("left_heel")
    ground = feet.base[0][toe, 1] + 6.0
    for _ in range(20):
        position = feet(np.zeros(3), 0.0, ground=ground)
    assert position[toe, 1] >= ground + 4.0 - 1e-3
    assert position[heel, 1] >= ground + 5.0 - 1e-3
    np.testing.assert_allclose(
        position[toe] - position[heel], feet.base[0][toe] - feet.base[0][heel], atol=1e-9
    )


def test_a_standing_foot_that_floats_comes_down(holden31: Skeleton) -> None:
    feet = Feet(holden31)
    toe, heel = holden31.role("left_toe"), holden31.role("left_heel")
    low = min(feet.base[0][toe, 1] - 4.0, feet.base[0][heel, 1] - 5.0)
    for gap, left in ((8.0, FLOATING), (2.0, 2.0)):
        for _ in range(30):
            standing = feet(np.zeros(3), 1.0, ground=low - gap)
        assert min(standing[toe, 1] - 4.0, standing[heel, 1] - 5.0) - (low - gap) == pytest.approx(
            left, abs=0.01
        )
    for _ in range(60):
        flying = feet(np.zeros(3), 0.0, ground=low - 8.0)
    assert flying[toe, 1] == pytest.approx(feet.base[0][toe, 1], abs=1e-3)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_the_character_stands_on_the_ground_it_is_given(steady, slope: float) -> None:
    character = ProceduralAnimation(steady)
    skeleton = steady.skeleton
    heights = [
        character.next_pose((0, 1.5), terrain=lambda x, z: slope * z).positions[skeleton.role("hips"), 1]
        for _ in range(200)
    ]
    # A figure that climbs a slope of .3 at 1.5 cm a frame rises .45 cm a frame.
    np.testing.assert_allclose(np.diff(heights[120:]).mean(), slope * 1.5, atol=0.01)


def test_standing_feet_raise_and_lower_the_body(holden31: Skeleton) -> None:
    """The foot in contact decides how far the body is raised or lowered; the hips stay within their range."""
    base, _ = crouched(holden31)
    legs, hips, sole = leg_joints(holden31), holden31.role("hips"), np.array([5.0, 4.0])
    soles = [min(base[leg[2], 1] - sole[0], base[leg[3], 1] - sole[1]) for leg in legs]

    def carried_to(left: float, right: float, contacts: list[float], low: float, high: float) -> float:
        """How far the figure is raised, cm. left, right: height of the ground under each foot. low, high:
        range of the hips.
        """
        ground = np.array([[left, left, right, right, (left + right) / 2]])
        lift = np.zeros(1)
        for _ in range(80):
            position = base[None].copy()
            both = legs, foot_parts(holden31, legs), sole, rest_facing(holden31), far
            carry_body(np.array([contacts], np.float32), ground, hips, (low, high), both, lift, position)
        moved = position[0] - base
        np.testing.assert_allclose(moved[:, 1], moved[0, 1], atol=1e-12)
        np.testing.assert_array_equal(moved[:, ::2], 0)
        return float(moved[0, 1])

    far, stands = 1e6, [1.0, 1.0, 0.0, 0.0]
    up, down = soles[0] + 20, soles[0] - 20
    assert carried_to(up, 0.0, stands, -far, far) == pytest.approx(20 - BODY_FREE, abs=1e-3)
    assert carried_to(down, 0.0, stands, -far, far) == pytest.approx(BODY_FREE - 20, abs=1e-3)
    assert carried_to(soles[0] + 2, 90.0, stands, -far, far) == 0.0
    assert carried_to(up, up, [0.0] * 4, -far, far) == 0.0
    above = base[hips, 1] - soles[0]
    assert carried_to(soles[0], soles[0], stands, -far, above - 6) == pytest.approx(-6)
    assert carried_to(soles[0], soles[0], [0.0] * 4, above + 5, far) == pytest.approx(5)
