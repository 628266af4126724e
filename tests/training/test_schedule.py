"""The learning rate goes as the configuration says, and noise is where it is meant to be."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from hobble.config.sections import Training
from hobble.database.reader import Database
from hobble.training.batches import HostRows
from hobble.training.network import initialise
from hobble.training.noise import Noise
from hobble.training.optimiser import Adam
from hobble.training.schedule import share
from hobble.training.train import train

Settings = dict[str, Any]
FAST = {"schedule": "cosine", "warm_up": 0.5, "noise": 0.1, "weight_decay": 1.0, "batch": 300}


def test_a_cosine_falls_from_one_to_nothing() -> None:
    recipe = {"schedule": "cosine", "warm_up": 0.0, "passes": 10}
    shares = [share(recipe, passes) for passes in np.linspace(0, 10, 101)]
    assert shares[0] == 1
    assert shares[50] == pytest.approx(0.5)
    assert shares[-1] == pytest.approx(0, abs=1e-12)
    assert all(a > b for a, b in pairwise(shares))
    assert np.mean(shares) == pytest.approx(0.5)


def test_a_constant_rate_rises_and_stays() -> None:
    recipe = {"schedule": "constant", "warm_up": 2.0, "passes": 10}
    assert [share(recipe, passes) for passes in (0, 0.5, 1, 2, 5, 10)] == [0, 0.25, 0.5, 1, 1, 1]


def test_each_batch_has_the_rate_of_its_place(
    data: Database, network: Settings, training: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a run that was interrupted too: a rate is a function of the samples seen, and of nothing else."""
    settings = training | FAST | {"passes": 2}
    rates: list[float] = []
    step = Adam.step

    def noted(self: Adam, gradients: list[torch.Tensor], rate: float = 1.0) -> None:
        rates.append(rate)
        if len(rates) == 10:
            raise KeyboardInterrupt
        step(self, gradients, rate)

    monkeypatch.setattr(Adam, "step", noted)
    with pytest.raises(KeyboardInterrupt):
        train(data, network=network, training=settings, checkpoints=tmp_path, threads=1)
    sizes = [300, 300, 166, 300, 300, 167, 300, 300, 167] * 2
    seen = np.cumsum([0, *sizes])[: len(sizes)]
    wanted = [share(settings, samples / 2300) for samples in seen]
    assert rates == pytest.approx(wanted[:10])
    del rates[9:]  # the section that was cut short is done again
    rates += [np.nan] * 3
    train(data, network=network, training=settings, checkpoints=tmp_path, threads=1)
    assert rates[12:] == pytest.approx(wanted[9:])


@pytest.mark.parametrize("changes", [FAST, FAST | {"batch": 32, "schedule": "constant"}])
def test_an_interrupted_training_with_a_schedule_ends_at_the_same_bits(
    data: Database,
    network: Settings,
    training: Settings,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    changes: Settings,
) -> None:
    arguments: Settings = {"network": network, "training": training | changes, "threads": 2}
    whole = train(data, **arguments, checkpoints=tmp_path / "whole")
    with monkeypatch.context() as patch:
        patch.setattr(HostRows, "batches", _stopping_at(4))
        with pytest.raises(KeyboardInterrupt):
            train(data, **arguments, checkpoints=tmp_path / "cut")
    resumed = train(data, **arguments, checkpoints=tmp_path / "cut")
    assert torch.equal(whole.network.flat, resumed.network.flat)
    assert torch.equal(whole.adam.second, resumed.adam.second)
    assert whole.best is not None
    assert resumed.best is not None
    assert torch.equal(whole.best, resumed.best)
    assert [row[4:] for row in whole.history] == [row[4:] for row in resumed.history]


def _stopping_at(turn: int) -> Any:
    batches = HostRows.batches

    def stopping(self: HostRows, pass_index: int, section: int, sections: int, *rest: int) -> Any:
        for number, batch in enumerate(batches(self, pass_index, section, sections, *rest)):
            if pass_index * sections + section == turn and number == 1:
                raise KeyboardInterrupt
            yield batch

    return stopping


def test_noise_is_on_the_fed_back_pose_alone_and_as_large_as_said(data: Database) -> None:
    noise = Noise(data, 0.5, torch.device("cpu"))
    x = torch.zeros(4000, data.layout.x_size)
    noise.seed(3)
    noise.add(x)
    layout, s = data.layout, data.statistics
    for of_x, of_y in (
        (layout.x_joint_position, layout.y_joint_position),
        (layout.x_joint_velocity, layout.y_joint_velocity),
    ):
        centimetres = x[:, of_x].numpy().std(0) * s.x_std[of_x]
        assert centimetres == pytest.approx(0.5 * s.y_std[of_y], rel=0.06)
    x[:, layout.x_joint_position.start : layout.x_joint_velocity.stop] = 0
    assert torch.count_nonzero(x) == 0


def test_noise_is_drawn_anew_and_again_from_its_seed(data: Database) -> None:
    noise = Noise(data, 0.5, torch.device("cpu"))
    drawn = []
    for seed in (3, 3, 4):
        noise.seed(seed)
        drawn.append(torch.zeros(3, data.layout.x_size))
        noise.add(drawn[-1])
    assert torch.equal(drawn[0], drawn[1])
    assert not torch.equal(drawn[0], drawn[2])
    noise.add(again := torch.zeros(3, data.layout.x_size))
    assert not torch.equal(again, drawn[2])


def test_no_noise_draws_nothing(data: Database) -> None:
    x = torch.ones(3, data.layout.x_size)
    Noise(data, 0.0, torch.device("cpu")).add(x)
    assert torch.equal(x, torch.ones_like(x))


def test_weight_decay_is_that_of_adamw() -> None:
    """Against PyTorch's own, on the weights; biases are left alone."""
    network = initialise((8, 6, 4), 4, 1)
    network.layers[0][:, :, -1] = 1.0
    layers = [layer.clone().requires_grad_() for layer in network.layers]
    theirs = torch.optim.AdamW(layers, lr=0.01, weight_decay=0.5)
    ours = Adam(network, 0.01, 0.9, 0.999, 0.0, weight_decay=0.5)
    generator = torch.Generator().manual_seed(1)
    for _ in range(10):
        gradients = [torch.randn(layer.shape, generator=generator) for layer in layers]
        for layer, gradient in zip(layers, gradients, strict=True):
            layer.grad = gradient
        biases = [layer[:, :, -1].detach().clone() for layer in layers]
        theirs.step()
        with torch.no_grad():
            for layer, bias in zip(layers, biases, strict=True):
                layer[:, :, -1] += 0.01 * 0.5 * bias
        ours.step(gradients)
    for mine, plain in zip(network.layers, layers, strict=True):
        assert torch.allclose(mine, plain, rtol=1e-4, atol=1e-6)


def test_a_rate_that_ends_at_nothing_cannot_be_gone_on_from() -> None:
    with pytest.raises(ValueError, match="`continues` needs `schedule: constant`"):
        Training(schedule="cosine", continues="holden")
