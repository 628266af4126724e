"""The captured update equals the plain one, tested with a graph that runs on a CPU."""

from __future__ import annotations

import contextlib
from typing import Any

import pytest
import torch

from hobble.models.step import AutogradStep, FusedStep
from hobble.training.optimiser import Adam, CapturedUpdate, Update, update_for
from tests.models.definition import fresh

ROWS = 12


class Graph:
    """Stands for a CUDA graph: it runs what was captured again, on the same memory."""

    update: CapturedUpdate

    def register_generator_state(self, generator: torch.Generator) -> None:
        assert isinstance(generator, torch.Generator)

    def replay(self) -> None:
        of_step = self.update.step.error
        self.update.loss.copy_(self.update._update_from_fixed_memory())
        self.update.error.copy_(self.update.step.error)
        self.update.step.error = of_step


class Stream:
    def wait_stream(self, other: Any) -> None:
        assert isinstance(other, Stream)


@pytest.fixture
def cuda(monkeypatch: pytest.MonkeyPatch) -> None:
    """The parts of CUDA that a capture needs."""
    for name, value in {
        "CUDAGraph": Graph,
        "Stream": Stream,
        "current_stream": Stream,
        "stream": lambda _: contextlib.nullcontext(),
        "graph": lambda _: contextlib.nullcontext(),
    }.items():
        monkeypatch.setattr(torch.cuda, name, value)


def updates() -> tuple[Update, CapturedUpdate]:
    made: list[Update] = []
    for kind in (Update, CapturedUpdate):
        network = fresh((8, 7, 7, 5))
        adam = Adam(network, 0.01, 0.9, 0.999, 0.01)
        step = AutogradStep(network, 0.3)
        made.append(kind(step, adam, ROWS) if kind is CapturedUpdate else kind(step, adam))
        step.seed(3)
    plain, captured = made
    assert isinstance(captured, CapturedUpdate)
    captured.graph.update = captured  # type: ignore[attr-defined]
    return plain, captured


@pytest.mark.usefixtures("cuda")
def test_a_captured_cuda_update_equals_the_plain_one() -> None:
    """Also with a shorter batch among others, and rates that change."""
    plain, captured = updates()
    assert torch.equal(plain.adam.network.flat, captured.adam.network.flat)
    assert torch.count_nonzero(captured.adam.second_moment) == 0
    assert captured.adam.steps == 0
    generator = torch.Generator().manual_seed(1)
    losses = []
    for rows, share in ((ROWS, 0.1), (ROWS, 1.0), (5, 0.7), (ROWS, 0.3)):
        x, y = (torch.randn(rows, n, generator=generator) for n in (8, 5))
        p = torch.rand(rows, generator=generator)
        losses.append([update(x.clone(), y.clone(), p, share) for update in (plain, captured)])
        errors = [update.step.error for update in (plain, captured)]
        assert torch.allclose(*errors, rtol=1e-4, atol=1e-5)
    for mine, theirs in losses:  # looked at afterwards, as the watch does
        assert float(mine) == pytest.approx(float(theirs), rel=1e-5)
    assert plain.adam.steps == captured.adam.steps == 4
    for name in ("first_moment", "second_moment"):
        assert torch.allclose(getattr(plain.adam, name), getattr(captured.adam, name), rtol=1e-4, atol=1e-7)
    assert torch.allclose(plain.adam.network.flat, captured.adam.network.flat, rtol=1e-4, atol=1e-6)


def test_nothing_is_captured_on_a_cpu() -> None:
    network = fresh((8, 7, 5))
    assert type(update_for(FusedStep(network, 0.3), Adam(network, 0.01, 0.9, 0.999, 0.0), 32)) is Update
