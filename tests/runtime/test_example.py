"""The game loop in examples/ runs."""

import json
import runpy
import sys
from pathlib import Path

import numpy as np
import pytest

from hobble.models.load import STATISTICS


def test_the_example_of_a_game_loop_runs(
    root: Path, tmp_path: Path, make_network, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    network = make_network(links=30)
    arrays = {f"W{i}": w for i, w in enumerate(network.weights)}
    arrays |= {f"b{i}": b for i, b in enumerate(network.biases)}
    arrays |= dict(
        zip(STATISTICS, (network.x_mean, network.x_std, network.y_mean, network.y_std), strict=True)
    )
    meta = {
        "layout": network.layout.to_dict(),
        "skeleton": network.skeleton.to_dict(),
        "channels": dict(network.channels),
    }
    np.savez(tmp_path / "weights.npz", **arrays, meta=np.array(json.dumps(meta)))
    monkeypatch.setattr(sys, "argv", ["game_loop.py", str(tmp_path)])
    left = runpy.run_path(str(root / "examples" / "game_loop.py"))
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 10
    assert lines[0].startswith(" 0 s at [")
    assert 0.5 < left["pose"].positions[0, 1] < 1.5  # metres
    assert left["pose"].channels["injury"].max() > 4
    code = (root / "examples" / "game_loop.py").read_text().split('"""')[2]
    assert len([line for line in code.splitlines() if line.strip()]) <= 20
