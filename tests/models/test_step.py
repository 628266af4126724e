"""The training steps compute the loss and the gradient of the definition."""

from typing import Any

import pytest
import torch

from hobble.models.mann import TrainableMann
from hobble.models.pfnn import TrainablePfnn
from hobble.models.plain import TrainablePlain
from hobble.models.step import AutogradStep, FusedStep
from hobble.training import optimiser
from hobble.training.optimiser import Adam

from . import definition
from .definition import new

STEPS = [AutogradStep, FusedStep]
# A class of networks, its arguments and the rows of a batch.
CASES: list[tuple[Any, tuple, int]] = [
    (TrainablePfnn, ((6, 5, 4), 4), 1),
    (TrainablePfnn, ((6, 5, 5, 3), 4), 33),
    (TrainablePfnn, ((7, 4, 4, 4, 3), 6), 8),
    (TrainablePlain, ((7, 4, 4, 4, 3), 1), 9),
    (TrainableMann, ((6, 5, 5, 3), 8, (2, 4, 4, 8), (1, 3)), 33),
    (TrainableMann, ((7, 4, 4, 4, 3), 3, (2, 3), (0, 6)), 8),
]
LARGE: list[tuple[Any, tuple]] = [
    (TrainablePfnn, ((30, 24, 24, 20), 4)),
    (TrainableMann, ((30, 24, 24, 20), 8, (6, 8, 8, 8), tuple(range(6)))),
]


def problem(kind: Any, arguments: tuple, rows: int, dtype: torch.dtype = torch.float64, spread: float = 0.5):
    """A network and a batch, both random."""
    generator = torch.Generator().manual_seed(3)
    network = new(kind, *arguments).to("cpu", dtype)
    network.flat.normal_(0, spread, generator=generator)
    x = torch.randn(rows, network.inputs, generator=generator, dtype=torch.float64)
    y = torch.randn(rows, network.outputs, generator=generator, dtype=torch.float64)
    p = torch.rand(rows, generator=generator, dtype=torch.float64)
    return network, x.to(dtype), y.to(dtype), p.to(dtype)


@pytest.mark.parametrize("step_class", STEPS)
@pytest.mark.parametrize(("kind", "arguments", "rows"), CASES)
def test_loss_and_gradient_are_those_of_the_definition(step_class, kind, arguments, rows) -> None:
    network, x, y, p = problem(kind, arguments, rows)
    step = step_class(network, 0.3)
    step.seed(5)
    masks = step.masks(rows)
    assert {round(float(value), 9) for mask in masks for value in mask.flatten()} >= {0.0, round(1 / 0.7, 9)}
    assert (masks[step.input_mask][:, network.inputs :] == 1).all(), "inputs after X are never dropped"
    found = step(x.clone(), y, p, masks)
    layers = [layer.clone().requires_grad_() for layer in network.layers]
    plain = definition.loss(network, layers, x, y, p, masks)
    plain.backward()
    assert float(found) == pytest.approx(plain.item(), rel=1e-12)
    for gradient, layer in zip(step.gradients, layers, strict=True):
        assert layer.grad is not None
        assert float(layer.grad.abs().max()) > 0
        assert torch.allclose(gradient.view(layer.shape), layer.grad, rtol=1e-9, atol=1e-13)


@pytest.mark.parametrize("step_class", STEPS)
@pytest.mark.parametrize("compiled", [True, False])
def test_ten_training_steps_equal_those_of_torch_adam(step_class, compiled, monkeypatch) -> None:
    """Ten steps with dropout, the L1 term and Adam, against PyTorch's own Adam on the plain definition."""
    if not compiled:
        monkeypatch.setattr(optimiser, "_adam_on_cpu", optimiser._adam_with_torch)
    network, x, y, p = problem(TrainablePfnn, ((6, 5, 5, 3), 4), 12)
    layers = [layer.clone().requires_grad_() for layer in network.layers]
    theirs = torch.optim.Adam(layers, lr=0.01, betas=(0.9, 0.99))
    ours, step = Adam(network, 0.01, 0.9, 0.99, l1=0.5), step_class(network, 0.3)
    step.seed(1)
    for _ in range(10):
        masks = step.masks(len(x))
        theirs.zero_grad()
        weights = sum(torch.mean(torch.abs(layer[:, :, :-1])) for layer in layers)
        error = definition.loss(network, layers, x, y, p, masks)
        (error + 0.5 * weights / (2 * len(layers))).backward()
        theirs.step()
        step(x, y, p, masks)
        ours.step(step.gradients)
    for mine, plain in zip(network.layers, layers, strict=True):
        assert torch.allclose(mine, plain, rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize(("kind", "arguments"), LARGE)
@pytest.mark.parametrize("step_class", STEPS)
@pytest.mark.parametrize("half", [False, True])
def test_the_gradient_is_exact_to_the_precision_of_the_factors(step_class, kind, arguments, half) -> None:
    network, x, y, p = problem(kind, arguments, 40, torch.float32, 0.1)
    exact = network.to("cpu", torch.float64)
    step, reference = step_class(network, 0.3, half), AutogradStep(exact, 0.3)
    masks = step.masks(len(x))
    found = step(x.clone(), y, p, masks)
    wanted = reference(x.double(), y.double(), p.double(), [mask.double() for mask in masks])
    assert found.dtype == torch.float32
    assert float(found) == pytest.approx(float(wanted), rel=1e-2 if half else 1e-5)
    for mine, plain in zip(step.gradients, reference.gradients, strict=True):
        mine = mine.double().view(plain.shape)
        assert float((mine - plain).norm() / plain.norm()) < (0.03 if half else 1e-5)
