"""Steps that differ: the same seed gives the same walk, and the spreads are as documented."""

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.skeleton import Skeleton, forward_kinematics, local_rotations
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.variation import find_arms, step_noise, swing_arms, vary_step

STEPS = np.arange(20_000)


def test_the_noise_is_the_same_in_every_language() -> None:
    """Calculated by hand in whole numbers."""

    def by_hand(seed: int, step: int, stream: int) -> float:
        x = (seed * 0x9E3779B1 + step * 0x85EBCA77 + stream * 0xC2B2AE3D) % 2**32
        x = (x ^ (x >> 16)) * 0x7FEB352D % 2**32
        x = (x ^ (x >> 15)) * 0x846CA68B % 2**32
        return (sum((x ^ (x >> 16)).to_bytes(4, "little")) - 510) / 147.8

    for case in ((0, 0, 0), (3, 17, 2), (2**31, 10**6, 3)):
        assert step_noise(np.array([case[0]]), np.array([case[1]]), case[2])[0] == by_hand(*case)
    noise = step_noise(0 * STEPS + 7, STEPS, 0)
    assert abs(noise.mean()) < 0.03
    assert noise.std() == pytest.approx(1.0, abs=0.02)
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 0.03


def test_the_same_seed_gives_the_same_walk_and_none_is_as_before(hurtable) -> None:
    def walk(**options) -> np.ndarray:
        animation = ProceduralAnimation(hurtable, characters=2, **options)
        poses = [animation.next_pose((0, 2)).positions.copy() for _ in range(200)]
        return np.array(poses)

    one, same, other = (walk(variation=1.0, seed=seed) for seed in (4, 4, 9))
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 0.1
    assert np.abs(one[:, 0] - one[:, 1]).max() > 0.1, "each character has a seed of its own"
    plain = walk()
    np.testing.assert_array_equal(plain[:, 0], plain[:, 1])


def test_knees_and_arms_differ_from_step_to_step_and_the_sides_of_a_person_do() -> None:
    for hurt, degrees, share in ((0.0, 3.8, 0.1), (1.0, 9.7, 0.2)):
        swing = vary_step(0 * STEPS + 3, STEPS, hurt + 0.0 * STEPS, 1.0)[3]
        for side in (swing[::2], swing[1::2]):
            np.testing.assert_allclose(side.std(axis=0), [np.radians(degrees), share], rtol=0.03)
        half = vary_step(0 * STEPS + 3, STEPS, hurt + 0.0 * STEPS, 0.5)[3]
        np.testing.assert_allclose(half, 0.5 * swing)
    sides = [vary_step(STEPS, 0 * STEPS + step, 0.0 * STEPS, 1.0)[3] for step in range(40)]
    differ = np.abs(np.mean(sides[::2], axis=0) - np.mean(sides[1::2], axis=0)).mean(axis=0)
    np.testing.assert_allclose(differ, [np.radians(4.85), 0.36], rtol=0.05)


def test_a_swinging_arm_swings_further_and_one_that_is_held_stays(holden31: Skeleton) -> None:
    arms, mean, ahead = find_arms(holden31), np.zeros((1, 2)), []
    local = np.tile([1.0, 0, 0, 0], (1, len(holden31.joints), 1))
    local[:, 0] = quat.yaw(0.7)
    for frame in range(600):
        for (shoulder, _, _), down, swing in zip(arms, (-1, 1), (0.3 * np.sin(frame / 9), 0.4), strict=True):
            hang = quat.from_axis_angle([0.0, 0, 1], down * np.pi / 2)
            local[:, shoulder] = quat.mul(quat.from_axis_angle([1.0, 0, 0], -swing), hang)
        rotation, position = forward_kinematics(holden31, local, np.zeros((1, 3)))
        before = position.copy()
        swing_arms(arms, np.array([[0.4, 0.4]]), mean, np.array([0.7]), position, rotation)
        bones = [at[0, elbow] - at[0, shoulder] for at in (before, position) for shoulder, elbow, _ in arms]
        ahead.append(np.arcsin(np.array(bones) @ [np.sin(0.7), 0, np.cos(0.7)] / 29.0))
        np.testing.assert_allclose(  # as if the joints had been turned before they were placed
            forward_kinematics(holden31, local_rotations(holden31, rotation), np.zeros((1, 3)))[1], position
        )  # fmt: skip
    plain, held, further, held_after = np.array(ahead)[400:].T
    assert np.ptp(further) == pytest.approx(1.4 * np.ptp(plain), rel=0.02)
    np.testing.assert_allclose(held_after, held, atol=2e-3)
