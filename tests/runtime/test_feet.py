"""Feet stay where they landed and on the ground; legs reach them without moving too fast."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.core import quat
from hobble.core.skeleton import Skeleton, forward_kinematics, two_bone_knee
from hobble.measures.walks import bend
from hobble.runtime.feet import (
    BODY_FREE,
    LOCK_AT,
    RELEASE,
    STEP_FRAMES,
    STEP_HEIGHT,
    STRETCH,
    TOO_FAR,
    carry_body,
    foot_parts,
    held_share,
    place_feet,
)
from hobble.runtime.leg import bend_leg, leg_joints, rest_facing


def crouched(skeleton: Skeleton, thigh: float = 0.5, knee: float = 0.9) -> tuple[np.ndarray, np.ndarray]:
    """Positions (J, 3) and world rotations (J, 4) of a figure. Radians: thighs forward, knees bent."""
    local = np.tile([1.0, 0, 0, 0], (1, len(skeleton.joints), 1))
    for side in ("left", "right"):
        local[0, skeleton.role(f"{side}_hip")] = quat.from_axis_angle([1.0, 0, 0], -thigh)
        local[0, skeleton.role(f"{side}_knee")] = quat.from_axis_angle([1.0, 0, 0], knee)
    rotations, positions = forward_kinematics(skeleton, local, np.array([[0.0, 90.0, 0.0]]))
    return positions[0], rotations[0]


class Feet:
    """`place_feet` with its state, on one figure."""

    def __init__(self, skeleton: Skeleton, *bent: float) -> None:
        self.legs = leg_joints(skeleton)
        self.below = foot_parts(skeleton, self.legs)
        self.held = np.zeros((1, 2)), np.zeros((1, 2, 2)), np.zeros((1, 2)), np.zeros((1, 2))
        self.lift, self.added = np.zeros((1, 2)), np.tile([1.0, 0, 0, 0], (1, 2, 2, 1))
        self.ahead, self.fastest, self.base = rest_facing(skeleton), 1e8, crouched(skeleton, *bent)
        self.shown, self.height = self.base[0][None, self.legs[:, 1:]], np.zeros(1)
        self.sink, self.more = np.zeros(1), np.zeros((1, 2))

    def __call__(
        self, moved: np.ndarray, contact: float, ground: float | None = None, other: float = 0.0
    ) -> np.ndarray:
        if ground is None:  # just under the feet, neither sunk nor floating
            ground = min(self.base[0][self.legs[0, 2], 1] - 5.0, self.base[0][self.legs[0, 3], 1] - 4.0) - 1.0
        position, rotation = self.base[0][None] + moved, self.base[1][None].copy()
        contacts = np.array([[contact, contact, other, other]], np.float32)
        legs = self.legs, self.below, np.array([5.0, 4.0]), self.ahead, self.fastest
        feet = self.held, self.lift, self.added, self.shown, self.height, np.zeros(1), self.sink, self.more
        place_feet(contacts, np.full((1, 4), ground), True, legs, feet, position, rotation)
        self.contacts, self.rotation = contacts[0], rotation[0]
        return position[0]


def test_a_foot_in_contact_stays_and_is_released_slowly(holden31: Skeleton) -> None:
    feet, toe, step = Feet(holden31), holden31.role("left_toe"), np.array([0.0, 0, 1.5])
    first = feet(0 * step, LOCK_AT)[toe]
    for k in range(1, 8):
        np.testing.assert_allclose(feet(k * step, 1.0)[toe], first, atol=1e-9)
    free = feet.base[0][toe] + 8 * step
    np.testing.assert_allclose(
        feet(8 * step, 0.0)[toe], free + held_share(1 - RELEASE) * (first - free), atol=1e-6
    )
    for _ in range(20):
        last = feet(8 * step, 0.0)[toe]
    np.testing.assert_allclose(last, free, atol=1e-9)


@pytest.mark.parametrize("more", [-0.3, 0.2])
def test_a_knee_that_bends_more_does_so_in_the_air_only(holden31: Skeleton, more: float) -> None:
    feet, plain = Feet(holden31), Feet(holden31)
    feet.more[0, 0] = more
    hip, knee, heel, toe = feet.legs[0]
    for k in range(10):  # on the ground
        moved = np.array([0.0, 0, k])
        before, shown = plain(moved, 1.0), feet(moved, 1.0)
        np.testing.assert_array_equal(shown, before)
    for _ in range(10):
        before, shown = plain(moved, 0.0, ground=-20.0), feet(moved, 0.0, ground=-20.0)
    bent = [bend(*place[[hip, knee, heel]]) for place in (before, shown)]  # degrees
    assert bent[1] - bent[0] == pytest.approx(np.degrees(more), abs=0.01)
    np.testing.assert_array_equal(shown[feet.legs[1]], before[feet.legs[1]])
    for _ in range(10):  # a foot that a straighter knee would lower into the ground stays on it
        ground = before[toe, 1] - 4.5
        assert feet(moved, 0.0, ground=ground)[toe, 1] >= ground + 4.0 - 1e-6


def glide(
    feet: Feet, speed: float, frames: int, **contacts: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The left toe (F, 3), where the network has it (F, 3), and whether it counts as standing (F,).

    The figure moves forward by `speed` cm a frame, and the network says that its feet stand.
    """
    toe = feet.legs[0, 3]
    shown, network, stands = [], [], []
    for k in range(frames):
        moved = np.array([0.0, 0, speed * k])
        shown.append(feet(moved, 1.0, **contacts)[toe])
        network.append(feet.base[0][toe] + moved)
        stands.append(feet.contacts[1] >= LOCK_AT)
    return np.array(shown), np.array(network), np.array(stands)


@pytest.mark.parametrize("speed", [0.4, 2.0])
def test_a_gliding_foot_steps_instead_of_sliding(holden31: Skeleton, speed: float) -> None:
    """While a foot counts as standing it does not move. Otherwise it is in the air."""
    feet = Feet(holden31)
    shown, network, stands = glide(feet, speed, int(150 / speed), other=1.0)
    still = stands[1:] & stands[:-1]
    moves = np.linalg.norm(np.diff(shown, axis=0)[:, ::2], axis=1)
    assert moves[still].max() < 1e-6
    assert np.abs(shown - network)[:, 2].max() < TOO_FAR + 2 * speed
    edges = np.flatnonzero(np.diff(stands.astype(int)))
    lengths = np.diff(edges)[::2]
    assert len(lengths) >= 3
    assert set(lengths) == {STEP_FRAMES - 1}
    high = shown[:, 1] - network[:, 1]
    for a, b in zip(edges[::2], edges[1::2], strict=False):
        assert STEP_HEIGHT - 1.5 < high[a + 1 : b + 1].max() <= STEP_HEIGHT
        assert np.abs(np.diff(high[a : b + 2])).max() < 1.5, "it rises and comes down gradually"
        assert high[b] < 2.5
        assert np.linalg.norm(shown[b + 1] - network[b + 1]) < 0.5, "it lands where the network has it"


def stretched(position: np.ndarray, legs: np.ndarray) -> float:
    """Distance from hip to heel joint of the left leg, as a share of its length."""
    hip, knee, heel, _ = position[legs[0]]
    return np.linalg.norm(heel - hip) / (np.linalg.norm(knee - hip) + np.linalg.norm(heel - knee))


def test_the_heel_of_a_held_foot_rises_before_its_leg_is_straight(holden31: Skeleton) -> None:
    """As the body goes on, the toe stays, the knee stays bent, and the foot turns about the toe, rigid."""
    feet = Feet(holden31, 0.15, 0.6)
    (hip, _, heel, toe), (start, turns) = feet.legs[0], feet.base
    foot, first = start[toe] - start[heel], start[toe]
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
    leg = np.linalg.norm(np.diff(start[feet.legs[0, :3]], axis=0), axis=1).sum()
    assert np.linalg.norm(first - [0, 0, 15.5] - foot - start[hip]) / leg > lengths[-1] + 0.005
    under = Feet(holden31, 0.05, 0.36)  # the toe is 1 cm ahead of the hip, the heel behind it
    lengths = [stretched(under(np.array([0.0, 0, z]), 1.0), under.legs) for z in np.arange(0, 5.5, 0.5)]
    assert lengths[-1] < lengths[0] + 0.0005, "the knee does not snap straight there, either"


@pytest.mark.parametrize("way", [[1.0, 0, 0], [0, 0, -1.0]])
def test_a_foot_held_beside_or_ahead_pulls_the_hips_down(holden31: Skeleton, way: list[float]) -> None:
    """The toe stays, the knee keeps its bend, the other foot is where it was; then the hips rise slowly."""
    feet = Feet(holden31, 0.3, 0.6)
    toe, other, heights = feet.legs[0, 3], feet.legs[1, 2:], []
    for moved in np.outer(np.arange(0, 16, 0.5), way):
        shown = feet(moved, 1.0)
        np.testing.assert_allclose(shown[toe], feet.base[0][toe], atol=1e-6)
        np.testing.assert_allclose(shown[other], (feet.base[0] + moved)[other], atol=1e-6)
        heights.append(shown[0, 1])
    assert stretched(shown, feet.legs) == pytest.approx(STRETCH, abs=1e-9)
    assert heights[0] - heights[-1] > 0.9
    heights += [feet(moved, 0.0)[0, 1] for _ in range(40)]
    assert np.abs(np.diff(heights)).max() < 1.0
    assert heights[-1] == pytest.approx(heights[0], abs=0.01)


def test_standing_feet_raise_and_lower_the_body(holden31: Skeleton) -> None:
    """The foot in contact decides how far the body is raised or lowered; the hips stay within their range."""
    base, _ = crouched(holden31)
    legs, hips, sole = leg_joints(holden31), holden31.role("hips"), np.array([5.0, 4.0])
    soles = [min(base[leg[2], 1] - sole[0], base[leg[3], 1] - sole[1]) for leg in legs]

    def carried_to(left: float, right: float, contacts: list[float], low: float, high: float) -> float:
        """How far the figure is raised, cm. left, right: ground under each foot. low, high: of the hips."""
        ground, lift = np.array([[left, left, right, right, (left + right) / 2]]), np.zeros(1)
        parts = legs, foot_parts(holden31, legs), sole, rest_facing(holden31), far
        for _ in range(80):
            position, given = base[None].copy(), np.array([contacts], np.float32)
            carry_body(given, ground, hips, (low, high, low), np.zeros(1), parts, lift, position)
        moved = position[0] - base
        np.testing.assert_allclose(moved, np.outer(np.ones(31), [0, moved[0, 1], 0]), atol=1e-12)
        return float(moved[0, 1])

    far, stands = 1e6, [1.0, 1.0, 0.0, 0.0]
    assert carried_to(soles[0] + 20, 0.0, stands, -far, far) == pytest.approx(20 - BODY_FREE, abs=1e-3)
    assert carried_to(soles[0] - 20, 0.0, stands, -far, far) == pytest.approx(BODY_FREE - 20, abs=1e-3)
    assert carried_to(soles[0] + 2, 90.0, stands, -far, far) == 0.0
    assert carried_to(90.0, 90.0, [0.0] * 4, -far, far) == 0.0
    above = base[hips, 1] - soles[0]
    assert carried_to(soles[0], soles[0], stands, -far, above - 6) == pytest.approx(-6)
    assert carried_to(soles[0], soles[0], [0.0] * 4, above + 5, far) == pytest.approx(5)


@given(*[st.floats(-25, 25)] * 3)
@settings(max_examples=40, deadline=None)
def test_reaching_with_a_leg_equals_two_bone_ik(holden31: Skeleton, x: float, y: float, z: float) -> None:
    (before, turned), joints = crouched(holden31), leg_joints(holden31)[0]
    hip, knee, heel, _ = joints
    shift, added = np.array([x, y, z]), np.tile([1.0, 0, 0, 0], (2, 1))
    for _ in range(12):  # enough frames to reach any of the targets
        position, rotation = before.copy(), turned.copy()
        last = before[joints[1:]], 0.0, 1e8
        bend_leg(position, rotation, joints, shift, rest_facing(holden31), added, last)
    upper, lower = (np.linalg.norm(before[b] - before[a]) for a, b in ((hip, knee), (knee, heel)))
    leg = before[heel] - before[hip]
    pole = quat.rotate(quat.between(leg, leg + shift), before[knee] - before[hip])
    expected = two_bone_knee(before[hip], before[heel] + shift, pole, upper, lower)
    np.testing.assert_allclose(position[[knee, heel]], expected, atol=1e-6)
    for joint, child in ((hip, knee), (knee, heel)):
        bone = quat.rotate(quat.inv(turned[joint]), before[child] - before[joint])
        moved = quat.rotate(rotation[joint], bone)
        np.testing.assert_allclose(moved, position[child] - position[joint], atol=1e-6)
    np.testing.assert_array_equal(*(np.delete(one, [hip, knee], axis=0) for one in (rotation, turned)))


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
