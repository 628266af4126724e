"""Ten minutes of the released network stay within the limits that the docs promise."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from hobble.models.load import load_network


@pytest.mark.slow
@pytest.mark.shared
def test_the_released_network_holds_for_ten_minutes(
    root: Path, shared: Path, holden31, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec = importlib.util.spec_from_file_location("stability", root / "benchmarks" / "stability.py")
    assert spec is not None
    assert spec.loader is not None
    benchmark = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, benchmark)  # where its dataclasses look for their module
    spec.loader.exec_module(benchmark)
    network = load_network(shared / "reference" / "pfnn_release_network.npz", holden31)
    found = benchmark.stability(network)
    assert found["steps"] > 800
    assert found["foot_down_share"] > 0.7
    assert found["skating_cm"] < 0.25
    assert found["stable"], benchmark.LIMITS
    sunk = network.y_mean.copy()
    sunk[network.layout.y_joint_position][1::3] -= 30
    assert not benchmark.stability(replace(network, y_mean=sunk), 0.25)["stable"]
