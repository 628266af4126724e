"""Steps that differ: the same seed gives the same walk, and the spreads are as documented."""

import numpy as np
import pytest

from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.variation import step_noise

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
