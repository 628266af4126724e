"""The network: its spline, its phase modes, its files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.core.errors import InputError
from hobble.models.forward import catmull_rom, weights_at
from hobble.models.load import load_network
from hobble.models.network import STORAGES, Network
from hobble.models.pfnn import OPTIONS
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


def reference(network: Network, x: np.ndarray, phase: np.ndarray) -> np.ndarray:
    """Y by blending the weights first, in float64, row by row."""
    out = []
    for row, p in zip(x, phase, strict=True):
        h = (row - network.x_mean.astype(float)) / network.x_std
        for i, (w, b) in enumerate(zip(network.weights, network.biases, strict=True)):
            h = spline(w, p) @ h + spline(b, p)
            if i < len(network.weights) - 1:
                h = np.where(h > 0, h, np.expm1(h))
        out.append(h * network.y_std + network.y_mean)
    return np.array(out)


def rows(network: Network, count: int = ROWS) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    x = rng.normal(0, 20, (count, network.layout.x_size)).astype(np.float32)
    return x, rng.random(count)


def arrays(network: Network) -> dict[str, np.ndarray]:
    out = {f"W{i}": w for i, w in enumerate(network.weights)}
    out |= {f"b{i}": b for i, b in enumerate(network.biases)}
    return out | {
        "Xmean": network.x_mean, "Xstd": network.x_std, "Ymean": network.y_mean, "Ystd": network.y_std
    }  # fmt: skip


@given(st.floats(0, 1, exclude_max=True), st.integers(4, 9))
@settings(max_examples=60, deadline=None)
def test_spline_weights_follow_the_definition(phase: float, points: int) -> None:
    table = np.random.default_rng(points).normal(size=(points, 3))
    np.testing.assert_allclose(weights_at(table, phase)[0], spline(table, phase), atol=1e-12)
    assert sum(catmull_rom(phase)) == pytest.approx(1)


@pytest.mark.parametrize("points", [4, 6])
def test_cubic_mode_equals_blending_the_weights_first(make_network, points: int) -> None:
    network = make_network(control_points=points, scale=20.0)
    x, phase = rows(network)
    np.testing.assert_allclose(network.predictor().predict(x, phase), reference(network, x, phase), atol=2e-4)


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("mode", OPTIONS.modes)
@pytest.mark.parametrize("count", [2, 23])
def test_a_crowd_equals_single_characters(make_network, mode: str, storage: str, count: int) -> None:
    network = make_network(scale=20.0)
    predictor = network.predictor(mode, storage)
    x, phase = rows(network, count)
    one_by_one = [predictor.predict(x[i : i + 1], phase[i : i + 1])[0] for i in range(count)]
    np.testing.assert_array_equal(predictor.predict(x, phase), one_by_one)


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


def test_a_column_that_never_varied_is_ignored(network: Network) -> None:
    std = network.x_std.copy()
    std[5] = 0
    blind = replace(network, x_std=std).predictor()
    x, phase = rows(network)
    before = blind.predict(x, phase)
    x[:, 5] += 1e6
    np.testing.assert_array_equal(before, blind.predict(x, phase))


def test_weights_file_round_trip(tmp_path: Path, hurtable: Network, holden31) -> None:
    meta = {
        "layout": hurtable.layout.to_dict(),
        "skeleton": holden31.to_dict(),
        "channels": {"injury": list(hurtable.channels["injury"])},
        "gaits": list(hurtable.gaits),
    }
    np.savez(tmp_path / "weights.npz", **arrays(hurtable), meta=np.array(json.dumps(meta)))
    for path in (tmp_path, tmp_path / "weights.npz"):
        back = load_network(path)
        assert back.layout == hurtable.layout
        assert back.channels["injury"] == hurtable.channels["injury"] == holden31.link_names
        assert back.skeleton is not None
        assert back.skeleton.joints == holden31.joints
        assert back.sizes == hurtable.sizes
        for a, b in zip(back.weights, hurtable.weights, strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda a: a.pop("b1"), "no b1"),
        (lambda a: a.pop("Ystd"), "no Ystd"),
        (lambda a: a.update(W1=a["W1"][:, :, :-1]), "W1"),
        (lambda a: a.update(W0=np.full_like(a["W0"], np.nan)), "not finite"),
        (lambda a: a.update(Ymean=a["Ymean"][:-1]), r"Ystd has shape \(311,\)"),
        (lambda a: a.update({k: v[:3] for k, v in a.items() if k[0] in "Wb"}), "3 control points"),
    ],
)
def test_a_malformed_file_is_refused_with_a_message(
    tmp_path: Path, network: Network, change, message: str
) -> None:
    broken = arrays(network)
    change(broken)
    np.savez(tmp_path / "weights.npz", **broken)
    with pytest.raises(InputError, match=message) as error:
        load_network(tmp_path)
    assert "weights.npz" in str(error.value)


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
