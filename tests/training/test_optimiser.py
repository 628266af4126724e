"""The compiled optimiser equals the plain one."""

from __future__ import annotations

import pytest
import torch

from hobble.training import optimiser
from hobble.training.optimiser import Adam
from tests.models.definition import fresh


def test_the_compiled_adam_equals_the_plain_one(monkeypatch: pytest.MonkeyPatch) -> None:
    networks = [fresh((40, 30, 20)) for _ in range(2)]
    generator = torch.Generator().manual_seed(1)
    adams = [Adam(network, 0.01, 0.9, 0.999, 0.1) for network in networks]
    for share in (0.2, 0.6, 1.0, 0.7, 0.0):
        gradients = [torch.randn(layer.shape, generator=generator) for layer in networks[0].layers]
        adams[0].step(gradients, share)
        with monkeypatch.context() as patch:
            patch.setattr(optimiser, "_adam_on_cpu", optimiser._adam_with_torch)
            adams[1].step(gradients, share)
    assert torch.allclose(networks[0].flat, networks[1].flat, rtol=1e-4, atol=1e-6)
    assert torch.allclose(adams[0].first_moment, adams[1].first_moment, rtol=1e-4, atol=1e-6)
