"""The network as ONNX gives the same numbers in another program."""

from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from hobble.cli.__main__ import main
from hobble.models.pfnn import OPTIONS
from hobble.models.pfnn.release import write_release


def run(path: Path, x: np.ndarray, phase: np.ndarray) -> np.ndarray:
    session = onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
    return session.run(["y"], {"x": x, "phase": phase.astype(np.float32)})[0]


@pytest.mark.parametrize("points", [4, 6])
@pytest.mark.parametrize("mode", OPTIONS.modes)
def test_onnxruntime_predicts_the_same_as_the_runtime(
    make_network, tmp_path: Path, mode: str, points: int
) -> None:
    network = make_network(control_points=points, scale=20.0)
    assert "by at most" in network.export("onnx", tmp_path / "network.onnx", mode)
    rng = np.random.default_rng(3)
    for rows in (1, 7):
        x = rng.normal(0, 20, (rows, network.layout.x_size)).astype(np.float32)
        # Also before 0 and after 1, and between every two points.
        phase = rng.uniform(-1, 2, rows).astype(np.float32)
        y = run(tmp_path / "network.onnx", x, phase)
        np.testing.assert_allclose(y, network.predictor(mode).predict(x, phase.astype(float)), atol=1e-4)


def test_the_command_exports_onnx(
    network, tmp_path: Path, root: Path, capsys: pytest.CaptureFixture
) -> None:
    write_release(tmp_path / "pfnn", network)
    skeleton = ["--skeleton", str(root / "config" / "skeletons" / "holden31.yaml")]
    target = tmp_path / "out" / "network.onnx"
    assert main(["export", "onnx", str(tmp_path / "pfnn"), str(target), "--mode", "linear", *skeleton]) == 0
    assert "network.onnx: differs from" in capsys.readouterr().out
    assert target.exists()
    assert main(["export", "bin", str(tmp_path / "pfnn"), str(tmp_path / "copy"), *skeleton]) == 0
    for path in (tmp_path / "pfnn").iterdir():
        a, b = (np.fromfile(p, "<f4") for p in (path, tmp_path / "copy" / path.name))
        np.testing.assert_allclose(a, b, atol=1e-6)
    capsys.readouterr()
    assert main(["export", "onnx", str(tmp_path), str(tmp_path / "x.onnx")]) == 1
    assert "not a network" in capsys.readouterr().err
    skeleton = ["--skeleton", str(root / "Makefile")]
    assert main(["export", "bin", str(tmp_path / "pfnn"), str(tmp_path), *skeleton]) == 1
    assert "Makefile" in capsys.readouterr().err
