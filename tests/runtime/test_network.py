"""The network: its spline, its phase modes, its files."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.models.forward import catmull_rom, weights_at
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.models.pfnn.release import write_release

ROWS = 7


def spline(points: np.ndarray, phase: float) -> np.ndarray:
    """The definition (Holden et al. 2017, eq. 7), written out: cyclic cubic Catmull-Rom in float64."""
    k = len(points)
    scaled = k * phase
    n = int(np.floor(scaled))
    w = scaled - n
    a0, a1, a2, a3 = (points[(n + i) % k].astype(float) for i in (-1, 0, 1, 2))
    return (
        a1
        + w * (a2 / 2 - a0 / 2)
        + w**2 * (a0 - 5 / 2 * a1 + 2 * a2 - a3 / 2)
        + w**3 * (3 / 2 * a1 - 3 / 2 * a2 + a3 / 2 - a0 / 2)
    )


def rows(network: Network, count: int = ROWS) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    x = rng.normal(0, 20, (count, network.layout.x_size)).astype(np.float32)
    return x, rng.random(count)


@given(st.floats(0, 1, exclude_max=True), st.integers(4, 9))
@settings(max_examples=60, deadline=None)
def test_spline_weights_follow_the_definition(phase: float, points: int) -> None:
    table = np.random.default_rng(points).normal(size=(points, 3))
    np.testing.assert_allclose(weights_at(table, phase)[0], spline(table, phase), atol=1e-12)
    assert sum(catmull_rom(phase)) == pytest.approx(1)


@given(st.floats(-2, 3))
@settings(max_examples=50, deadline=None)
def test_no_phase_reads_outside_the_table(phase: float) -> None:
    from hobble.models.predict import write_phase_shares

    for blended, points in ((1, 50), (2, 10), (4, 4)):
        for p in (phase, 1.0, np.nextafter(1.0, 0.0), np.float64(np.float32(0.99999999))):
            # A number on each side, since compiled code does not check that an index is within the array.
            around = np.full(points + 2, 7, np.float32)
            around[1:-1] = 0
            write_phase_shares(blended, np.array([p]), around[None, 1:-1])
            assert around[[0, -1]].tolist() == [7, 7]
            assert around[1:-1].sum() == pytest.approx(1, abs=1e-6)
            assert np.count_nonzero(around[1:-1]) <= blended


def test_release_folder_round_trip(tmp_path: Path, network: Network, holden31) -> None:
    write_release(tmp_path / "pfnn", network)
    assert (tmp_path / "pfnn" / "W2_049.bin").stat().st_size == 4 * network.weights[2][0].size
    back = load_network(tmp_path / "pfnn", holden31)
    for a, b in zip((*back.weights, *back.biases), (*network.weights, *network.biases), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-6)
    x, phase = rows(network)
    np.testing.assert_allclose(
        back.predictor().predict(x, phase), network.predictor().predict(x, phase), atol=1e-4
    )


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
