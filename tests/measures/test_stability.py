"""Ten minutes of the released network stay within the limits that the docs promise; how feet slide."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.measures.walks import feet_in_stance
from hobble.models.load import load_network


@pytest.fixture
def benchmark(root: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    spec = importlib.util.spec_from_file_location("stability", root / "benchmarks" / "stability.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)  # where its dataclasses look for their module
    spec.loader.exec_module(module)
    return module


def test_foot_slide_is_the_distance_that_the_toe_moves_in_stance(benchmark: Any) -> None:
    contacts, toes = np.zeros((40, 4)), np.zeros((40, 2, 3))
    contacts[5:15, 1] = 1.0
    contacts[20:22, 1] = 1.0  # too short to be a step
    contacts[10:30, 3] = 0.6
    toes[:, 0, 0] = 0.3 * np.arange(40)
    toes[:, 1, 1] = np.arange(40)  # rising is not sliding
    np.testing.assert_allclose(benchmark.foot_slide(toes, contacts), [0.3 * 9, 0.0], atol=1e-9)
    assert feet_in_stance(contacts)[:, 0].sum() == 12


@pytest.mark.slow
@pytest.mark.shared
def test_the_released_network_holds_for_ten_minutes(benchmark: Any, shared: Path, holden31) -> None:
    network = load_network(shared / "reference" / "pfnn_release_network.npz", holden31)
    found = benchmark.stability(network)
    assert found["steps"] > 800
    assert found["foot_down_share"] > 0.7
    assert found["skating_cm"] < 0.25
    assert found["stable"], benchmark.LIMITS
    sunk = network.y_mean.copy()
    sunk[network.layout.y_joint_position][1::3] -= 30
    assert not benchmark.stability(replace(network, y_mean=sunk), 0.25)["stable"]
