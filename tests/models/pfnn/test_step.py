"""The fast steps compute the loss and the gradient of the definition, exactly."""

from __future__ import annotations

import pytest
import torch

from hobble.models.pfnn.fused import FusedPfnnStep
from hobble.models.pfnn.step import PfnnStep
from hobble.models.pfnn.trainable import untrained_network
from hobble.training.optimiser import Adam

from . import definition

STEPS = [PfnnStep, FusedPfnnStep]
SHAPES = [((6, 5, 4), 4, 1), ((6, 5, 5, 3), 4, 33), ((7, 4, 4, 4, 3), 6, 8)]


def problem(sizes: tuple[int, ...], k: int, rows: int, dtype: torch.dtype = torch.float64):
    generator = torch.Generator().manual_seed(3)
    network = untrained_network(sizes, k, 1).to("cpu", dtype)
    network.flat.normal_(0, 0.5, generator=generator)
    x = torch.randn(rows, sizes[0], generator=generator, dtype=torch.float64)
    y = torch.randn(rows, sizes[-1], generator=generator, dtype=torch.float64)
    p = torch.rand(rows, generator=generator, dtype=torch.float64)
    return network, x.to(dtype), y.to(dtype), p.to(dtype)


@pytest.mark.parametrize("kind", STEPS)
@pytest.mark.parametrize(("sizes", "k", "rows"), SHAPES)
def test_loss_and_gradient_are_those_of_the_definition(
    kind: type[PfnnStep], sizes: tuple[int, ...], k: int, rows: int
) -> None:
    network, x, y, p = problem(sizes, k, rows)
    step = kind(network, 0.3)
    step.seed(5)
    masks = step.masks(rows)
    assert len({float(value) for mask in masks for value in mask.flatten()}) == 2
    loss = step(x, y, p, masks)
    layers = definition.parameters(network)
    plain, _ = definition.loss(layers, x, y, p, masks, 0)
    plain.backward()
    assert float(loss) == pytest.approx(plain.item(), rel=1e-12)
    for gradient, layer in zip(step.gradients, layers, strict=True):
        assert layer.grad is not None
        assert torch.allclose(gradient.view(layer.shape), layer.grad, rtol=1e-10, atol=1e-13)


@pytest.mark.parametrize("kind", STEPS)
def test_ten_training_steps_equal_those_of_autograd_and_torch_adam(kind: type[PfnnStep]) -> None:
    """Ten steps with dropout, the L1 term and Adam, against autograd and PyTorch's own Adam."""
    network, x, y, p = problem((6, 5, 5, 3), 4, 12)
    layers = definition.parameters(network)
    theirs = torch.optim.Adam(layers, lr=0.01, betas=(0.9, 0.99))
    ours, step = Adam(network, 0.01, 0.9, 0.99, l1=0.5), kind(network, 0.3)
    step.seed(1)
    for _ in range(10):
        masks = step.masks(len(x))
        theirs.zero_grad()
        definition.loss(layers, x, y, p, masks, 0.5)[1].backward()
        theirs.step()
        step(x, y, p, masks)
        ours.step(step.gradients)
    for mine, plain in zip(network.layers, layers, strict=True):
        assert torch.allclose(mine, plain, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize("kind", STEPS)
def test_the_gradient_in_float32_equals_that_in_float64_to_its_precision(kind: type[PfnnStep]) -> None:
    network, x, y, p = problem((30, 24, 24, 20), 4, 40, torch.float32)
    exact = network.to("cpu", torch.float64)
    step, reference = kind(network, 0.3), PfnnStep(exact, 0.3)
    masks = step.masks(len(x))
    loss = step(x, y, p, masks)
    reference(x.double(), y.double(), p.double(), [mask.double() for mask in masks])
    assert loss.dtype == torch.float32
    for mine, plain in zip(step.gradients, reference.gradients, strict=True):
        assert torch.allclose(mine.double(), plain, rtol=1e-4, atol=1e-6 * float(plain.abs().max()))


@pytest.mark.parametrize("kind", STEPS)
def test_bfloat16_factors_give_the_gradient_to_their_precision(kind: type[PfnnStep]) -> None:
    network, x, y, p = problem((30, 24, 24, 20), 4, 40, torch.float32)
    network.flat.mul_(0.2)
    half, whole = kind(network, 0.3, half=True), PfnnStep(network, 0.3)
    masks = half.masks(len(x))
    loss, exact = half(x, y, p, masks), whole(x, y, p, masks)
    assert loss.dtype == torch.float32
    assert float(loss) == pytest.approx(float(exact), rel=1e-2)
    for mine, plain in zip(half.gradients, whole.gradients, strict=True):
        assert mine.dtype == torch.bfloat16
        assert float((mine.float() - plain).norm() / plain.norm()) < 0.02


def test_both_steps_round_to_bfloat16_alike() -> None:
    network, x, y, p = problem((30, 24, 20), 4, 40, torch.float32)
    steps = [kind(network, 0.3, half=True) for kind in STEPS]
    masks = steps[0].masks(len(x))
    for step in steps:
        step(x, y, p, masks)
    for one, other in zip(steps[0].gradients, steps[1].gradients, strict=True):
        assert float((one.float() - other.float()).norm() / one.float().norm()) < 5e-3


@pytest.mark.parametrize("kind", STEPS)
@pytest.mark.parametrize("dropout", [0.0, 0.3])
def test_dropout_keeps_its_share_and_scales_it_up(kind: type[PfnnStep], dropout: float) -> None:
    network = untrained_network((300, 200, 10), 4, 1)
    step = kind(network, dropout)
    step.seed(9)
    first = [mask.clone() for mask in step.masks(500)]
    assert [tuple(mask.shape) for mask in first] == [(500, 300), (500, 200)]
    for mask in first:
        assert set(mask.unique().tolist()) <= {0.0, torch.tensor(1 / (1 - dropout)).item()}
        assert float((mask > 0).float().mean()) == pytest.approx(1 - dropout, abs=0.005)
        assert float((mask > 0).float().mean(0).std()) < 0.05  # no column is dropped more often than others
        assert float((mask > 0).float().mean(1).std()) < 0.05
    second = [mask.clone() for mask in step.masks(500)]
    step.seed(9)
    again = [mask.clone() for mask in step.masks(500)]
    assert all(torch.equal(a, b) for a, b in zip(first, again, strict=True))
    if dropout:
        assert not torch.equal(first[0], second[0])
        both = (first[0] > 0) & (second[0] > 0)
        assert float(both.float().mean()) == pytest.approx((1 - dropout) ** 2, abs=0.01)


def test_batches_of_other_sizes_share_the_buffers() -> None:
    network, x, y, p = problem((6, 5, 5, 3), 4, 33)
    step, plain = FusedPfnnStep(network, 0.0), PfnnStep(network, 0.0)
    for rows in (33, 7, 33, 1):
        masks = step.masks(rows)
        assert float(step(x[:rows], y[:rows], p[:rows], masks)) == pytest.approx(
            float(plain(x[:rows], y[:rows], p[:rows], masks)), rel=1e-12
        )
        for one, other in zip(step.gradients, plain.gradients, strict=True):
            assert torch.allclose(one, other, rtol=1e-10, atol=1e-13)
