"""The step of the plain network gives the gradient of its loss."""

from __future__ import annotations

import pytest
import torch

from hobble.models.plain.trainable import FusedPlainStep, PlainStep, untrained_network


@pytest.mark.parametrize("kind", [PlainStep, FusedPlainStep])
@pytest.mark.parametrize("units", [(6, 5, 4), (7, 4, 4, 4, 3)])
def test_loss_and_gradient_are_those_of_autograd(kind: type, units: tuple[int, ...]) -> None:
    """Written out layer by layer, with the same dropout."""
    generator = torch.Generator().manual_seed(3)
    network = untrained_network(units, 1).to("cpu", torch.float64)
    network.flat.normal_(0, 0.5, generator=generator)
    x, y = (torch.randn(9, n, generator=generator, dtype=torch.float64) for n in (units[0], units[-1]))
    p = torch.rand(9, generator=generator, dtype=torch.float64)
    step = kind(network, 0.3)
    step.seed(5)
    masks = step.masks(9)
    assert {float(v) for v in masks[1].flatten()} == {0.0, 1 / 0.7}
    assert (masks[0][:, -2:] == 1).all(), "the phase is never dropped"
    assert not (masks[0][:, :-2] == 1).any()
    layers = [layer[:, 0].clone().requires_grad_() for layer in network.layers]
    h = torch.cat([x, torch.sin(2 * torch.pi * p)[:, None], torch.cos(2 * torch.pi * p)[:, None]], dim=1)
    for number, layer in enumerate(layers):
        h = h if number == 0 else torch.nn.functional.elu(h)
        h = (h * masks[number]) @ layer[:, :-1].T + layer[:, -1]
    plain = torch.mean((h - y) ** 2)
    plain.backward()
    assert float(step(x, y, p, masks)) == pytest.approx(plain.item(), rel=1e-12)
    assert torch.allclose(step.error, h - y, rtol=1e-10, atol=1e-13)
    for gradient, layer in zip(step.gradients, layers, strict=True):
        assert layer.grad is not None
        assert torch.allclose(gradient.view(layer.shape), layer.grad, rtol=1e-10, atol=1e-13)
