"""A foot in contact stays where it landed, until the network lifts it or until it has to step."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.runtime.feet import (
    LOCK_AT,
    MISSED,
    RELEASE,
    STEP_FRAMES,
    STEP_HEIGHT,
    TOO_FAR,
    TOO_FAR_ALONE,
)
from tests.runtime.one_figure import Feet


def test_a_foot_in_contact_stays_and_is_released_slowly(holden31: Skeleton) -> None:
    feet = Feet(holden31)
    toe = holden31.role("left_toe")
    step = np.array([0.0, 0, 1.5])
    first = feet(0 * step, LOCK_AT)[toe]
    for k in range(1, 8):
        np.testing.assert_allclose(feet(k * step, 1.0)[toe], first, atol=1e-9)
    free = feet.base[0][toe] + 8 * step
    np.testing.assert_allclose(feet(8 * step, 0.0)[toe], free + (1 - RELEASE) * (first - free), atol=1e-6)
    for _ in range(20):
        last = feet(8 * step, 0.0)[toe]
    np.testing.assert_allclose(last, free, atol=1e-9)


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
        assert STEP_HEIGHT - 1.5 < high[a + 1 : b + 1].max() < STEP_HEIGHT
        assert 0.3 < high[a + 1] < 2.5, "it rises and comes down gradually"
        assert high[b] < 2.5
        assert np.linalg.norm(shown[b + 1] - network[b + 1]) < 0.5, "it lands where the network has it"


def test_a_foot_waits_while_the_other_is_in_the_air(holden31: Skeleton) -> None:
    """With the other foot down it steps after TOO_FAR, without it after TOO_FAR_ALONE, if its leg reaches."""
    for other, far in ((1.0, TOO_FAR), (0.0, TOO_FAR_ALONE)):
        feet = Feet(holden31, 0.5, 1.2)
        _, network, stands = glide(feet, 0.5, 120, other=other)
        held = network[np.argmin(stands), 2] - network[0, 2]
        assert far <= held <= far + 0.5
    both = Feet(holden31)
    glide(both, 2.0, 12, other=1.0)
    assert (both.step > 0).sum() == 1, "never both at once"


def test_a_foot_that_its_leg_cannot_reach_steps(holden31: Skeleton) -> None:
    """The body rises by 30 cm, further than a leg stretches, while the foot is held 8 cm ahead."""
    feet = Feet(holden31, 0.2, 0.35)
    toe = holden31.role("left_toe")
    first = feet(np.zeros(3), 1.0, other=1.0)[toe]
    slid = []
    for k in range(1, 20):
        shown = feet(np.array([0.0, min(1.5 * k, 30.0), -8.0]), 1.0, ground=0.0, other=1.0)[toe]
        if feet.contacts[1] < LOCK_AT:
            break
        slid.append(np.hypot(*(shown - first)[::2]))
    assert feet.contacts[1] == 0.0
    assert 0.0 < max(slid) < MISSED + 2.0
