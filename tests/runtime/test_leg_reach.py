"""Legs reach their targets by bending, and no joint moves or turns faster than allowed."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.core import quat
from hobble.core.skeleton import Skeleton, two_bone_knee
from hobble.runtime.feet import leg_joints, rest_facing
from hobble.runtime.leg_reach import KNEE_AHEAD, MOST_ADDED, bend_leg, move_heel
from tests.runtime.one_figure import Feet, crouched

coordinate = st.floats(-25, 25)


@given(coordinate, coordinate, coordinate)
@settings(max_examples=40, deadline=None)
def test_reaching_with_a_leg_equals_two_bone_ik(holden31: Skeleton, x: float, y: float, z: float) -> None:
    position, rotation = crouched(holden31)
    hip, knee, heel, _ = leg_joints(holden31)[0]
    before, turned = position.copy(), rotation.copy()
    shift = np.array([x, y, z])
    added, leg = np.tile([1.0, 0, 0, 0], (2, 1)), leg_joints(holden31)[0]
    for _ in range(12):  # enough frames to reach any of the targets
        position, rotation = before.copy(), turned.copy()
        bend_leg(position, rotation, leg, shift, rest_facing(holden31), added, (before[leg[1:]], 0.0, 1e8))
    upper, lower = (
        np.linalg.norm(before[knee] - before[hip]),
        np.linalg.norm(before[heel] - before[knee]),
    )
    leg = before[heel] - before[hip]
    pole = quat.rotate(quat.between(leg, leg + shift), before[knee] - before[hip])
    expected = two_bone_knee(before[hip], before[heel] + shift, pole, upper, lower)
    np.testing.assert_allclose(position[knee], expected[0], atol=1e-6)
    np.testing.assert_allclose(position[heel], expected[1], atol=1e-6)
    # The bones' rotations go with them, the others stay.
    for joint, child in ((hip, knee), (knee, heel)):
        bone = quat.rotate(quat.inv(turned[joint]), before[child] - before[joint])
        moved = quat.rotate(rotation[joint], bone)
        np.testing.assert_allclose(moved, position[child] - position[joint], atol=1e-6)
    others = [j for j in range(len(position)) if j not in (hip, knee)]
    np.testing.assert_array_equal(rotation[others], turned[others])


def test_no_leg_turns_too_fast_for_any_foot_target(holden31: Skeleton) -> None:
    """With hips that jump at random, thigh and shank keep their lengths and turn by at most MOST_ADDED."""
    rng = np.random.default_rng(3)
    feet = Feet(holden31)
    hip, knee, heel, _ = leg_joints(holden31)[0]
    lengths = np.linalg.norm(np.diff(feet.base[0][[hip, knee, heel]], axis=0), axis=1)
    last, furthest, plain = feet.base[1], 0.0, 0.0
    for _ in range(400):
        moved = rng.uniform(-30, 30, 3)
        position = feet(moved, rng.random(), ground=rng.uniform(-10, 30))
        between = quat.mul(feet.rotation, quat.inv(last))
        furthest = max(furthest, float(2 * np.arccos(np.minimum(1, np.abs(between[:, 0]))).max()))
        np.testing.assert_allclose(
            np.linalg.norm(np.diff(position[[hip, knee, heel]], axis=0), axis=1), lengths, rtol=1e-6
        )
        straight = feet.base[0] + moved
        move_heel(straight, hip, knee, heel, rng.uniform(-30, 30, 3), tuple(feet.ahead), KNEE_AHEAD)
        leg, base = straight[knee] - straight[hip], feet.base[0][knee] - feet.base[0][hip]
        plain = max(plain, float(np.arccos(leg @ base / lengths[0] ** 2)))
        last = feet.rotation
    assert furthest <= MOST_ADDED + 1e-6
    assert plain > 1.5 * MOST_ADDED, "the feet asked for should need more"


def ahead_of_leg(position: np.ndarray, leg: np.ndarray) -> float:
    """How far the knee is in front of the line from hip to heel, cm."""
    hip, knee, heel, _ = position[leg]
    share = (knee[1] - hip[1]) / (heel[1] - hip[1])
    return float((knee - hip - share * (heel - hip))[2])


def test_a_knee_that_passes_the_line_from_hip_to_heel_stays_in_front(holden31: Skeleton) -> None:
    """The network's leg gets straight and bends backward, while its foot is held. The knee does not flip."""
    feet = Feet(holden31, 0.25, 0.5)
    hip, knee, heel, toe = feet.legs[0]
    straight, knees = feet.base[0].copy(), []
    line = straight[heel] - straight[hip]
    line /= np.linalg.norm(line)
    out = straight[knee] - straight[hip] - line * ((straight[knee] - straight[hip]) @ line)
    out /= np.linalg.norm(out)
    middle = straight[hip] + 0.46 * (straight[heel] - straight[hip])
    for k, ahead in enumerate(np.linspace(4, -4, 60)):
        feet.base[0][knee] = middle + ahead * out
        shown = feet(np.array([0.0, 0, min(0.2 * k, 6.0)]), 1.0)
        assert ahead_of_leg(shown, feet.legs[0]) > 1
        knees.append(shown[knee])
    assert np.linalg.norm(np.diff(knees, axis=0), axis=1).max() < 2
    for _ in range(10):  # also without a foot that is held
        free = feet(np.zeros(3), 0.0)
    assert ahead_of_leg(free, feet.legs[0]) > 1
    np.testing.assert_allclose(free[toe], straight[toe], atol=0.1)


def test_knee_heel_and_toe_move_no_further_in_a_frame_than_allowed(holden31: Skeleton) -> None:
    """The network jumps at random. When it stops, the leg gets to where it is without the limit."""
    fastest = {}
    for limit in (9.0, 1e8):
        rng, feet = np.random.default_rng(4), Feet(holden31)
        feet.fastest = limit
        below, shown = feet.legs[0, 1:], [feet.base[0]]
        for _ in range(300):
            moved, contact, ground = rng.uniform(-4, 4, 3), rng.integers(2), rng.uniform(-5, 25)
            shown.append(feet(moved, contact, ground=ground))
        fastest[limit] = np.linalg.norm(np.diff(np.array(shown)[:, below], axis=0), axis=-1).max()
        for _ in range(60):
            last = feet(np.zeros(3), 0.0, ground=-50.0)
        np.testing.assert_allclose(last, feet.base[0], atol=1e-3)
    assert fastest[9.0] <= 9.0 + 1e-6
    assert fastest[1e8] > 12
