"""The phase-functioned network: its phase modes, its files, and its exports, which give the same numbers."""

from pathlib import Path

import numpy as np
import onnxruntime
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.cli.__main__ import main
from hobble.models.load import load_network
from hobble.models.pfnn import OPTIONS
from hobble.models.pfnn.release import write_release
from hobble.models.predict import write_phase_shares


@given(st.floats(-2, 3))
@settings(max_examples=50, deadline=None)
def test_no_phase_reads_outside_the_table(phase: float) -> None:
    for blended, points in ((1, 50), (2, 10), (4, 4)):
        for p in (phase, 1.0, np.nextafter(1.0, 0.0), np.float64(np.float32(0.99999999))):
            # A number on each side, since compiled code does not check that an index is within the array.
            around = np.full(points + 2, 7, np.float32)
            around[1:-1] = 0
            write_phase_shares(blended, np.array([p]), around[None, 1:-1])
            assert around[[0, -1]].tolist() == [7, 7]
            assert around[1:-1].sum() == pytest.approx(1, abs=1e-6)
            assert np.count_nonzero(around[1:-1]) <= blended


@pytest.mark.shared
def test_the_released_network_predicts_its_published_rows(shared: Path) -> None:
    data = np.load(shared / "reference" / "original_rows_LocomotionFlat09_000.npz")
    network = load_network(shared / "reference" / "pfnn_release_network.npz")
    assert network.sizes == (342, 512, 512, 311)
    assert network.parameter_count == 597_815
    y = network.predictor("constant").predict(data["X"], data["P"].astype(float))
    assert np.abs(y - data["Y_release"]).max() < 1e-3
    stored = network.predictor("constant", "int16").predict(data["X"], data["P"].astype(float))
    joints = network.layout.y_joint_position
    assert np.abs(stored - y)[:, joints].max() < 0.01  # 0.1 mm


@pytest.mark.parametrize("points", [4, 6])
@pytest.mark.parametrize("mode", OPTIONS.modes)
def test_onnxruntime_predicts_the_same_as_the_runtime(
    make_network, tmp_path: Path, mode: str, points: int
) -> None:
    network = make_network(control_points=points, scale=20.0)
    assert "by at most" in network.export("onnx", tmp_path / "network.onnx", mode)
    session = onnxruntime.InferenceSession(tmp_path / "network.onnx", providers=["CPUExecutionProvider"])
    rng = np.random.default_rng(3)
    for rows in (1, 7):
        x = rng.normal(0, 20, (rows, network.layout.x_size)).astype(np.float32)
        # Also before 0 and after 1, and between every two points.
        phase = rng.uniform(-1, 2, rows).astype(np.float32)
        (y,) = session.run(["y"], {"x": x, "phase": phase})
        np.testing.assert_allclose(y, network.predictor(mode).predict(x, phase.astype(float)), atol=1e-4)


def test_the_command_exports_onnx_and_bin(
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
