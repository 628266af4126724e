"""The response to injury: sweeps, their numbers, and networks that feel nothing."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import spearmanr

from hobble.evaluation.injury import GAITS, SEVERITIES, Sweep, injury_response, spearman

RUNTIME = {
    "mode": "cubic",
    "severity_rate": 10.0,
    "severity_scale": 1.0,
    "foot_locking": True,
    "steering": 1.0,
}
KNEE = "LeftUpLeg-LeftLeg"


def slowing(hurtable, links: tuple[str, ...] = (KNEE,)):
    """A network whose root is the slower, and whose head the lower, the more `links` hurt, and nothing else.

    One unit of each hidden layer carries 1 + severity / 10 through the ELU, where it is linear.
    """
    layout = hurtable.layout
    weights = [np.zeros_like(w) for w in hurtable.weights]
    biases = [np.zeros_like(b) for b in hurtable.biases]
    for link in links:
        weights[0][:, 0, layout.x_injury.start + hurtable.links.index(link)] = 2.0  # the inputs are over 20
    biases[0][:, 0] = 1.0
    weights[1][:, 0, 0] = 1.0
    head = layout.y_joint_position.start + 3 * hurtable.skeleton.role("head") + 1
    for column, effect in ((layout.y_root_velocity.start + 1, -0.5), (head, -4.0)):
        weights[2][:, column, 0] = effect / hurtable.y_std[column]
        biases[2][:, column] = -effect / hurtable.y_std[column]
    return replace(
        hurtable, weights=tuple(weights), biases=tuple(biases), x_mean=np.zeros_like(hurtable.x_mean)
    )


def response(network, **options: Any) -> dict[str, Any]:
    options = {"configuration": "x", "runtime": RUNTIME, "seconds": 4.0, "links": [KNEE]} | options
    return injury_response(network, **options)


def test_a_network_without_severities(network) -> None:
    result = response(network)
    assert result == {
        "configuration": "x",
        "applies": False,
        "reason": "this network has no severity inputs",
    }


def test_a_response_that_is_known(hurtable) -> None:
    """Speed falls by .05 cm a frame and the head by .4 cm for each unit of severity.

    Predicted joint velocities stay, so every joint also runs ahead of the slower root: half of the mismatch,
    and half of that again, ..., .05 cm in all.
    """
    each = (30 * 0.05 + np.hypot(0.4, 0.05)) / 31
    result = response(slowing(hurtable))
    walk = [row for row in result["rows"] if row["gait"] == "walk"]
    assert [row["severity"] for row in walk] == SEVERITIES.tolist()
    np.testing.assert_allclose([r["speed"] for r in walk], 60 * (1.5 - 0.05 * SEVERITIES), rtol=0.01)
    np.testing.assert_allclose([r["from_healthy"] for r in walk], each * SEVERITIES, atol=0.005)
    np.testing.assert_allclose([r["from_worst"] for r in walk], each * (10 - SEVERITIES), atol=0.005)
    for gait, found in zip(GAITS, result["responses"], strict=True):
        assert found["gait"] == gait
        assert found["link"] == KNEE
        assert found["spearman"]["speed"] == pytest.approx(-1)
        assert found["spearman"]["from_healthy"] == pytest.approx(1)
        assert found["speed_share"] == pytest.approx(2 / 3, rel=0.02)
        assert found["after_healing_cm"] == pytest.approx(0, abs=1e-3)
        assert found["from_healthy_cm"] == pytest.approx(10 * each, rel=0.02)
        # The severity climbs for a second, and a mean over a second follows it for another.
        assert 0.9 < found["settle_seconds"] < 2.1
    assert result["summary"]["walk"]["spearman_speed"] == pytest.approx(-1)


def test_a_link_that_is_not_felt_changes_nothing(hurtable) -> None:
    result = response(slowing(hurtable), links=["Neck1-Head"])
    found = result["responses"][0]
    assert found["from_healthy_cm"] == pytest.approx(0, abs=1e-6)
    assert found["spearman"]["speed"] is None
    assert found["speed_share"] == pytest.approx(1)
    json.dumps(result, allow_nan=False)


def test_links_default_to_those_hurt_in_training(hurtable) -> None:
    seen = np.zeros_like(hurtable.x_mean)
    seen[hurtable.layout.x_injury.start + 7] = 0.1
    result = response(replace(hurtable, x_mean=seen), links=None, seconds=0.5)
    assert result["links"] == [hurtable.links[7]] == ["RightUpLeg-RightLeg"]
    assert len(result["rows"]) == 2 * 11


def test_the_same_numbers_each_time(hurtable) -> None:
    assert response(hurtable, seconds=1.0) == response(hurtable, seconds=1.0)


def test_all_walk_healthy_before_the_onset(hurtable) -> None:
    sweep = Sweep(hurtable, KNEE, "walk", 2.0, RUNTIME)
    same = sweep.world[: sweep.onset]
    np.testing.assert_allclose(same, same[:, :1].repeat(11, axis=1), atol=1e-3)
    worst = sweep.world[sweep.healing - 1]
    assert np.abs(worst - worst[:1]).max() > 1e-3


@given(st.lists(st.one_of(st.none(), st.integers(-3, 3).map(float)), min_size=11, max_size=11))
@settings(max_examples=40, deadline=None)
def test_spearman_is_scipys(values: list[float | None]) -> None:
    known = [i for i, v in enumerate(values) if v is not None]
    found = spearman(SEVERITIES, values)
    if len(known) < 3 or len({values[i] for i in known}) < 2:
        assert found is None
    else:
        expected = spearmanr(SEVERITIES[known], [values[i] for i in known]).statistic
        assert found == pytest.approx(expected, abs=1e-5)
