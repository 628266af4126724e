"""The measurement of stability, and ten minutes of the released network."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.evaluation import stability as module
from hobble.evaluation.stability import KINDS, LIMITS, random_targets, stability
from hobble.models.load import load_network


def test_the_script_has_every_kind_of_target() -> None:
    script = list(random_targets(10.0))
    assert sum(s.frames for s in script) == 10 * 3600
    assert {s.kind for s in script} == set(KINDS)
    for s in script:
        speed, aside, gait = KINDS[s.kind]
        assert np.hypot(*s.velocity) == pytest.approx(speed)
        assert (s.facing is not None) == aside
        assert s.gait == gait
    assert [s.frames for s in random_targets(10.0, 2)] != [s.frames for s in script]


@pytest.mark.shared
def test_the_released_network_holds_for_ten_minutes(shared: Path, holden31) -> None:
    found = stability(load_network(shared / "reference" / "pfnn_release_network.npz", holden31))
    assert found["finite"]
    assert found["hips_lowest_cm"] > 60
    assert found["hips_highest_cm"] < 110
    assert found["largest_turn_degrees"] < 60
    assert found["foot_slide_cm"] < 2
    assert found["steps"] > 800
    assert found["foot_down_share"] > 0.7
    assert found["skating_cm"] < 0.25
    assert found["stable"]


@pytest.mark.shared
def test_implausible_motion_is_reported(shared: Path, holden31, monkeypatch: pytest.MonkeyPatch) -> None:
    network = load_network(shared / "reference" / "pfnn_release_network.npz", holden31)
    whole = stability(network, 0.25)
    assert whole["stable"]
    mean = network.y_mean.copy()
    mean[network.layout.y_joint_position][1::3] -= 30
    assert not stability(replace(network, y_mean=mean), 0.25)["stable"]
    for name in ("hips_highest_cm", "largest_turn_degrees"):
        with monkeypatch.context() as patch:
            patch.setitem(module.LIMITS, name, whole[name] - 0.1)
            assert not stability(network, 0.25)["stable"], name
    assert LIMITS["hips_highest_cm"] == 110
