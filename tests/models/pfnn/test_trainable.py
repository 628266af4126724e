"""The network equals the one of the paper."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.models.pfnn.fused import FusedPfnnStep
from hobble.models.pfnn.trainable import TrainablePfnn, coefficients, parameter_count, untrained_network

from .definition import output, spline

phases = st.floats(0, 1, allow_subnormal=False)


@settings(max_examples=50, deadline=None)
@given(p=phases, k=st.integers(4, 9))
def test_the_spline_is_catmull_rom(p: float, k: int) -> None:
    points = torch.linspace(-3, 5, k, dtype=torch.float64) ** 2
    c = coefficients(torch.tensor([p], dtype=torch.float64), k)[0]
    assert float(c.sum()) == pytest.approx(1)
    assert float(c @ points) == pytest.approx(float(spline(points, p)), abs=1e-9)


@pytest.mark.parametrize("k", [4, 5])
def test_the_spline_passes_its_control_points_and_is_cyclic(k: int) -> None:
    knots = torch.arange(k, dtype=torch.float64) / k
    assert torch.equal(coefficients(knots, k), torch.eye(k, dtype=torch.float64))
    assert torch.allclose(coefficients(knots + 1, k), coefficients(knots, k))
    assert torch.equal(coefficients(torch.ones(1, dtype=torch.float64), k)[0], torch.eye(k)[0].double())


def test_compiled_spline_coefficients_equal_the_plain_ones() -> None:
    network = untrained_network((3, 4, 2), 5, 1)
    p = torch.tensor([0.0, 0.2, 0.37, 0.999, 1.0])
    assert torch.allclose(FusedPfnnStep(network, 0.3).coefficients(p), coefficients(p, 5), atol=1e-6)


@pytest.mark.parametrize(
    ("sizes", "count"),
    [
        ((342, 512, 512, 311), 597_815),
        ((342, 512, 512, 512, 311), 860_471),
        ((1302, 512, 512, 1751), 1_828_055),
    ],
)
def test_parameter_counts_equal_those_of_the_published_networks(sizes: tuple[int, ...], count: int) -> None:
    assert parameter_count(sizes, 4) == 4 * count


def test_initial_weights_fill_their_bounds_and_biases_are_zero() -> None:
    network = untrained_network((40, 30, 20), 4, 1)
    for layer, (a, b) in zip(network.layers, ((40, 30), (30, 20)), strict=True):
        bound = (6 / (a * b)) ** 0.5
        assert layer.shape == (b, 4, a + 1)
        assert torch.count_nonzero(layer[:, :, -1]) == 0
        weights = layer[:, :, :-1]
        assert float(weights.abs().max()) <= bound
        assert float(weights.abs().max()) > 0.98 * bound
        assert abs(float(weights.mean())) < 0.05 * bound
        assert float(weights.std()) == pytest.approx(bound / 3**0.5, rel=0.05)


def test_equal_seeds_give_equal_networks() -> None:
    one, same, other = (untrained_network((5, 4, 3), 4, seed).flat for seed in (1, 1, 2))
    assert torch.equal(one, same)
    assert not torch.equal(one, other)


def test_blended_outputs_are_those_of_blended_weights() -> None:
    network = untrained_network((6, 5, 5, 3), 4, 1).to("cpu", torch.float64)
    network.flat.normal_(generator=torch.Generator().manual_seed(1))
    x, p = torch.randn(7, 6, dtype=torch.float64), torch.rand(7, dtype=torch.float64)
    ones = [torch.ones(size, dtype=torch.float64) for size in network.sizes[:-1]]
    plain = torch.stack([output(network.layers, x[i], float(p[i]), ones) for i in range(7)])
    assert torch.allclose(network(x, p), plain, rtol=1e-12, atol=1e-12)


@pytest.mark.shared
def test_the_network_in_training_reproduces_the_released_one(shared: Path) -> None:
    """Y_release was computed with the weights of phase bin floor(50 P), at most 49."""
    weights = np.load(shared / "reference" / "pfnn_release_network.npz")
    rows = np.load(shared / "reference" / "original_rows_LocomotionFlat09_000.npz")
    parts = []
    for number in range(3):
        w, b = weights[f"W{number}"], weights[f"b{number}"]
        layer = np.concatenate([w.transpose(1, 0, 2), b.reshape(4, -1).T[:, :, None]], axis=2)
        parts.append(torch.from_numpy(np.ascontiguousarray(layer, np.float32)).flatten())
    network = TrainablePfnn(torch.cat(parts), (342, 512, 512, 311), 4)
    p = np.minimum(np.floor(rows["P"] * 50), 49) / 50
    mean, std = (weights[name].ravel() for name in ("Ymean", "Ystd"))
    x = (rows["X"] - weights["Xmean"].ravel()) / weights["Xstd"].ravel()
    y = network(torch.from_numpy(x.astype(np.float32)), torch.from_numpy(p.astype(np.float32))).numpy()
    assert np.abs(y - (rows["Y_release"] - mean) / std).max() < 1e-2
    assert np.abs(y * std + mean - rows["Y_release"]).max() < 0.02
