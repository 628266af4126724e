"""The fast steps compute the loss and the gradient of the definition, exactly."""

from __future__ import annotations

import pytest
import torch

from hobble.models.mann.fused import FusedMannStep
from hobble.models.mann.step import MannStep
from hobble.models.mann.trainable import TrainableMann, untrained_network

from .definition import output

STEPS = [MannStep, FusedMannStep]
# Sizes of an expert, of the gate, the columns that it sees, rows.
SHAPES = [
    ((6, 5, 4), (3, 4, 2), (5, 0, 2), 1),
    ((6, 5, 5, 3), (2, 4, 4, 8), (1, 3), 33),
    ((7, 4, 4, 4, 3), (2, 3), (0, 6), 8),
]


def problem(sizes, gate, columns, rows, dtype=torch.float64, spread=0.5):
    generator = torch.Generator().manual_seed(3)
    network = untrained_network(sizes, gate, columns, 1).to("cpu", dtype)
    network.flat.normal_(0, spread, generator=generator)
    x, y = (torch.randn(rows, n, generator=generator, dtype=torch.float64) for n in (sizes[0], sizes[-1]))
    return network, x.to(dtype), y.to(dtype), torch.zeros(rows, dtype=dtype)


@pytest.mark.parametrize("kind", STEPS)
@pytest.mark.parametrize(("sizes", "gate", "columns", "rows"), SHAPES)
def test_loss_and_gradient_are_those_of_the_definition(kind, sizes, gate, columns, rows) -> None:
    network, x, y, p = problem(sizes, gate, columns, rows)
    step = kind(network, 0.3)
    step.seed(5)
    masks = step.masks(rows)
    assert [mask.shape for mask in masks] == [(rows, n) for n in (*gate[:-1], *sizes[:-1])]
    loss = step(x.clone(), y, p, masks)
    layers = [layer.clone().requires_grad_() for layer in network.layers]
    plain = torch.stack([output(network, layers, x[i], [mask[i] for mask in masks]) for i in range(rows)])
    error = torch.mean((plain - y) ** 2)
    error.backward()
    assert float(loss) == pytest.approx(error.item(), rel=1e-12)
    assert torch.allclose(step.error, plain - y, rtol=1e-10, atol=1e-12)
    for gradient, layer in zip(step.gradients, layers, strict=True):
        assert layer.grad is not None
        assert float(layer.grad.abs().max()) > 0
        assert torch.allclose(gradient.view(layer.shape), layer.grad, rtol=1e-9, atol=1e-13)


def test_without_dropout_the_error_is_that_of_the_network() -> None:
    network, x, y, p = problem(*SHAPES[1])
    step = FusedMannStep(network, 0.0)
    step(x.clone(), y, p, step.masks(len(x)))
    assert torch.allclose(step.error, network(x, p) - y, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("kind", STEPS)
def test_bfloat16_factors_give_the_gradient_to_their_precision(kind) -> None:
    network, x, y, p = problem((30, 24, 24, 20), (6, 8, 8, 8), tuple(range(6)), 40, torch.float32, 0.1)
    half, whole = kind(network, 0.3, half=True), MannStep(network, 0.3)
    masks = [mask.clone() for mask in half.masks(len(x))]
    loss, exact = half(x.clone(), y, p, masks), whole(x.clone(), y, p, masks)
    assert float(loss) == pytest.approx(float(exact), rel=1e-2)
    for mine, plain in zip(half.gradients, whole.gradients, strict=True):
        assert mine.dtype == torch.bfloat16
        assert float((mine.float() - plain).norm() / plain.norm()) < 0.03


def test_batches_of_other_sizes_share_the_buffers() -> None:
    network, x, y, p = problem(*SHAPES[1])
    step, plain = FusedMannStep(network, 0.0), MannStep(network, 0.0)
    for rows in (33, 7, 33, 1):
        masks = step.masks(rows)
        step(x[:rows].clone(), y[:rows], p[:rows], masks)
        plain(x[:rows].clone(), y[:rows], p[:rows], masks)
        for one, other in zip(step.gradients, plain.gradients, strict=True):
            assert torch.allclose(one, other, rtol=1e-9, atol=1e-13)


def test_initial_weights_fill_their_bounds_and_experts_have_equal_shares() -> None:
    network: TrainableMann = untrained_network((40, 30, 20), (5, 8, 4), (0, 1, 2, 3, 4), 1)
    for layer, (a, b) in zip(network.layers, ((5, 8), (8, 4), (40, 30), (30, 20)), strict=True):
        bound = (6 / (a * b)) ** 0.5
        assert torch.count_nonzero(layer[:, :, -1]) == 0
        assert 0.9 * bound < float(layer[:, :, :-1].abs().max()) <= bound
    experts = network.layers[2].view(4, 30, 41)
    assert not torch.equal(experts[0], experts[1])
