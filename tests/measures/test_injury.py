"""The response to injury: sweeps, their numbers, and networks without an effect."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from hobble.measures import injury_run as module
from hobble.measures.injury_run import SEVERITIES, second_sweep
from hobble.measures.walks import CrowdTarget, generate_walks
from hobble.runtime import Runtime

RUNTIME = Runtime(steering=0.0)
KNEE = "LeftUpLeg-LeftLeg"


def slowing(hurtable, links: tuple[str, ...] = (KNEE,)):
    """A network that walks slower and lowers its head in proportion to the severities of `links`.

    One unit of each hidden layer carries 1 + severity / 10 through the ELU, where it is linear.
    """
    layout = hurtable.layout
    weights, biases = ([np.zeros_like(w) for w in each] for each in (hurtable.weights, hurtable.biases))
    for link in links:
        column = layout.x_channel("injury").start + hurtable.channels["injury"].index(link)
        weights[0][:, 0, column] = 2.0  # the inputs are over 20
    biases[0][:, 0] = weights[1][:, 0, 0] = 1.0
    head = layout.y_joint_position.start + 3 * hurtable.skeleton.role("head") + 1
    for column, effect in ((layout.y_root_velocity.start + 1, -0.5), (head, -4.0)):
        weights[2][:, column, 0] = effect / hurtable.y_std[column]
        biases[2][:, column] = -effect / hurtable.y_std[column]
    changed = {"weights": tuple(weights), "biases": tuple(biases), "x_mean": np.zeros_like(hurtable.x_mean)}
    return replace(hurtable, **changed)


def response(network, **options: Any) -> dict[str, Any]:
    options = {"configuration": "x", "runtime": RUNTIME, "seconds": 4.0, "links": [KNEE]} | options
    return module.injury_response(network, **options)


def test_the_response_of_a_network_with_a_known_slowdown_is_exact(hurtable) -> None:
    """Speed falls by .05 cm a frame and the head by .4 cm for each unit of severity.

    Predicted joint velocities stay, so every joint also runs ahead of the slower root: half of the mismatch,
    and half of that again, ..., .05 cm in all.
    """
    each = (30 * 0.05 + np.hypot(0.4, 0.05)) / 31
    result = response(slowing(hurtable))
    walk, (found,) = result["rows"], result["responses"]
    assert [row["severity"] for row in walk] == SEVERITIES.tolist()
    np.testing.assert_allclose([r["speed"] for r in walk], 60 * (1.5 - 0.05 * SEVERITIES), rtol=0.01)
    np.testing.assert_allclose([r["from_healthy"] for r in walk], each * SEVERITIES, atol=0.005)
    np.testing.assert_allclose([r["from_worst"] for r in walk], each * (10 - SEVERITIES), atol=0.005)
    assert found["link"] == KNEE
    assert found["spearman"]["speed"] == pytest.approx(-1)
    assert found["spearman"]["from_healthy"] == pytest.approx(1)
    assert found["speed_share"] == pytest.approx(2 / 3, rel=0.02)
    assert found["after_healing_cm"] == pytest.approx(0, abs=1e-3)
    assert found["from_healthy_cm"] == pytest.approx(10 * each, rel=0.02)
    assert result["summary"]["spearman_speed"] == pytest.approx(-1)
    json.dumps(result, allow_nan=False)


def test_every_link_is_swept_and_those_never_hurt_are_marked(hurtable) -> None:
    seen = np.zeros_like(hurtable.x_mean)
    start = hurtable.layout.x_channel("injury").start
    seen[start + 7] = seen[start + 2] = 0.1
    result = response(replace(hurtable, x_mean=seen), links=None, seconds=0.2)
    hurt = ["LeftUpLeg-LeftLeg", "RightUpLeg-RightLeg"]
    assert result["links"] == list(hurtable.channels["injury"])
    assert result["trained"] == hurt
    assert len(result["rows"]) == 30 * 11
    assert [r["link"] for r in result["responses"] if r["trained"]] == hurt
    assert result["second_sweep"] == [], "none of the published pairs"
    strips = [(r["link"], r["severities"], np.shape(r["poses"])) for r in result["strips"]]
    assert strips == [(link, (0, 4, 7, 10), (4, 31, 3)) for link in hurt]
    assert {r["link"] for r in result["into_a_jog"]} == {None, *hurt}


def test_a_second_injury_is_swept_over_a_first_as_published(hurtable) -> None:
    """Each injury lowers the head by .4 cm and slows the walk by 3 cm/s for each unit of severity."""
    shank, thigh = "LeftLeg-LeftFoot", "RightUpLeg-RightLeg"
    found = second_sweep(slowing(hurtable, (shank, thigh)), [shank, thigh], 2.0, RUNTIME)
    rows, each = found["second_sweep"], (30 * 0.05 + np.hypot(0.4, 0.05)) / 31
    first, second = np.array([(r["first_severity"], r["severity"]) for r in rows]).T
    assert (first.tolist(), second.tolist()) == ([5] * 11 + [10] * 11, 2 * list(range(11)))
    np.testing.assert_allclose([r["from_first_cm"] for r in rows], each * second, atol=0.01)
    np.testing.assert_allclose([r["from_second_cm"] for r in rows], each * first, atol=0.01)
    np.testing.assert_allclose([r["speed"] for r in rows], 90 - 3 * (first + second), rtol=0.02)
    np.testing.assert_allclose([r["speed_of_first"] for r in rows], 90 - 3 * first, rtol=0.02)
    for row, leads in zip(found["second_thresholds"], ((5, 6), (10, None)), strict=True):
        # A tenth and nine tenths of a change in even steps, up to rounding.
        assert row["begins"] in (1, 2)
        assert row["capped"] in (9, 10)
        assert row["second_leads"] in leads
        assert row["equal_speed_share"] is None or row["equal_speed_share"] < 0, "slower than either alone"
    (strip,) = found["second_strips"]
    assert (strip["link"], strip["first"], strip["severities"]) == (thigh, shank, (0, 5))
    lower = np.subtract(*np.array(strip["poses"])[:, hurtable.skeleton.role("head"), 1])
    assert lower == pytest.approx(5 * 0.4, abs=0.11)


def test_an_injury_lasts_from_a_walk_into_a_jog(hurtable) -> None:
    found = module.into_a_jog(slowing(hurtable), [KNEE, "Neck1-Head"], 2.0, RUNTIME)
    rows = {(r["link"], r["severity"]): r for r in found}
    links = (KNEE, "Neck1-Head")
    assert list(rows) == [(None, 0.0), *((link, float(s)) for link in links for s in range(1, 11))]
    speeds = [rows[KNEE, float(s)]["jog_speed"] for s in range(1, 11)]
    np.testing.assert_allclose(np.diff(speeds), -60 * 0.05, rtol=0.05)
    assert rows[KNEE, 10.0]["kept"] == pytest.approx(1, rel=0.05)
    assert rows[KNEE, 5.0]["walk_speed"] == pytest.approx(60 * 1.25, rel=0.02)
    assert rows["Neck1-Head", 10.0]["kept"] is None
    assert rows[None, 0.0]["jog_from_healthy_cm"] == 0


def test_whole_cycles_are_measured(hurtable) -> None:
    walks = generate_walks(hurtable, [CrowdTarget(n, ["walk"], [{}]) for n in (20, 400, 10)], RUNTIME)
    phase = np.zeros((430, 1))
    phase[:, 0] = np.mod(0.013 * np.arange(430), 1)
    known = replace(walks, phase=phase)
    span = known.measured_frames(1, 0)
    assert span.stop == 420
    assert span.start >= 120
    turned = 0.013 * (span.stop - 1 - span.start)
    assert turned == pytest.approx(np.round(turned), abs=0.014)
    assert known.measured_frames(2, 0) == slice(422, 430)  # less than a cycle: all but its beginning


def test_a_figure_walks_the_same_alone_and_in_a_crowd(hurtable) -> None:
    """A healthy figure, and four that are hurt, hurt more, and healed, some of them faster."""
    links = list(hurtable.channels["injury"][:5])
    gaits, speeds = ["walk", "jog", "walk", "jog", "walk"], [2.5, 6.0, 1.0, 7.0, 2.5]
    hurt = [[{"injury": {link: i * share}} for i, link in enumerate(links)] for share in (0, 1, 2, 0)]
    together = generate_walks(hurtable, [CrowdTarget(20, gaits, one, speeds) for one in hurt], Runtime())
    assert np.ptp(together.local[-1], axis=0).max() > 0
    for i, gait in enumerate(gaits):
        script = [CrowdTarget(20, [gait], [one[i]], [speeds[i]]) for one in hurt]
        alone = generate_walks(hurtable, script, Runtime())
        for name in ("local", "contacts", "phase", "root", "acceleration"):
            np.testing.assert_array_equal(getattr(alone, name)[:, 0], getattr(together, name)[:, i], name)
