"""The long test accepts plausible characters and finds implausible ones."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hobble.evaluation.soak import LIMITS, StanceSlides, soak, varied_ground
from hobble.models.pfnn.network import Pfnn
from hobble.models.training_facts import TrainingFacts
from hobble.runtime import controller, feet

HIPS = 93.0  # cm above the ground, of the figures of `mean_output`


def on_its_feet(network: Pfnn) -> Pfnn:
    """The network, with bounds of figures whose hips move by at most 8 cm and whose feet are in contact."""
    mean = network.y_mean.copy()
    mean[network.layout.y_contacts] = 1.0
    x = np.zeros(network.layout.x_size, np.float32)
    x[network.layout.x_direction][network.layout.samples :] = 1
    x[network.layout.x_gait].reshape(-1, network.layout.samples)[1] = 1
    x[network.layout.x_joint_position] = mean[network.layout.y_joint_position]
    seen = TrainingFacts(x - 50, x + 50, mean - 8, mean + 8, x, mean, start_phase=0.3, fastest=9.0)
    return replace(network, y_mean=mean, training_facts=seen)


def test_hips_stay_above_the_ground_under_them(hurtable: Pfnn) -> None:
    """The networks know only the mean height of the path, not the hills."""
    found = soak(on_its_feet(hurtable), 20, 150)
    assert found["frames"] == 3000
    assert HIPS - 8.1 <= found["hips_lowest_cm"] <= found["hips_highest_cm"] <= HIPS + 8.1
    assert found["finite"]
    assert found["holds"]


def test_hips_without_ground_under_them_are_found(hurtable: Pfnn, monkeypatch: pytest.MonkeyPatch) -> None:
    still = {
        name: getattr(feet, name)
        for name in ("leg_joints", "sole_heights", "foot_parts", "rest_facing", "place_feet")
    }
    monkeypatch.setattr(controller, "feet", SimpleNamespace(**still, carry_body=lambda *_: None))
    found = soak(on_its_feet(hurtable), 20, 150)
    assert found["hips_lowest_cm"] < HIPS - 10
    assert found["hips_highest_cm"] > HIPS + 10


def test_a_leg_that_snaps_is_found(hurtable: Pfnn, monkeypatch: pytest.MonkeyPatch) -> None:
    whole = soak(on_its_feet(hurtable), 8, 150)
    assert whole["added_turn_degrees"] <= LIMITS["added_turn_degrees"]
    plain = feet.place_feet

    def snapping(*given) -> None:
        plain(*given)
        given[-1][3, 1] = np.roll(given[-1][3, 1], 1)  # a joint of the fourth character is turned about

    still = {
        name: getattr(feet, name)
        for name in ("leg_joints", "sole_heights", "foot_parts", "rest_facing", "carry_body")
    }
    turns = iter(range(10**6))
    monkeypatch.setattr(
        controller,
        "feet",
        SimpleNamespace(**still, place_feet=lambda *g: (snapping if next(turns) == 90 else plain)(*g)),
    )
    found = soak(on_its_feet(hurtable), 8, 150)
    assert found["added_turn_degrees"] > LIMITS["added_turn_degrees"]
    assert found["frames_beyond"] >= 1
    assert not found["holds"]


def test_slides_are_measured_over_whole_stances() -> None:
    slides = StanceSlides(np.zeros((1, 2)), np.zeros((1, 2), int))
    before = np.zeros((1, 2, 3))
    for k in range(8):
        toes = before + np.array([[0.5, 1.0, 0.0], [0.0, 0.0, 0.0]])
        slides.add(toes, before, np.array([[k < 6, k < 2]]))
        before = toes
    np.testing.assert_allclose(
        np.concatenate(slides.ended_slides), [2.5]
    )  # the right foot's contact was too short


def test_random_grounds_are_flat_sloping_and_steep() -> None:
    ground = varied_ground(200, np.random.default_rng(1))
    x = np.linspace(-400, 400, 801)
    tall = [np.ptp(ground(x + 4e4 * c, 0 * x)) for c in range(200)]
    steep = max(np.abs(np.diff(ground(x + 4e4 * c, 0 * x))).max() for c in range(200))
    assert 20 < sum(h == 0 for h in tall) < 80
    assert 0.25 < steep <= 0.36
