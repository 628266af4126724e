"""The learning rate follows the configured schedule."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from hobble.database.reader import Database
from hobble.training.batches import HostRows
from hobble.training.optimiser import Adam
from hobble.training.options import Training
from hobble.training.train import train

Settings = dict[str, Any]
FAST = {"schedule": "cosine", "warm_up": 0.5, "rollout": 4, "batch": 300}


def test_a_cosine_falls_from_one_to_nothing() -> None:
    recipe = Training(schedule="cosine", passes=10)
    shares = [recipe.learning_rate_share(passes) for passes in np.linspace(0, 10, 101)]
    assert shares[0] == 1
    assert shares[50] == pytest.approx(0.5)
    assert shares[-1] == pytest.approx(0, abs=1e-12)
    assert all(a > b for a, b in pairwise(shares))
    assert np.mean(shares) == pytest.approx(0.5)


def test_each_batch_has_the_rate_of_its_place(
    data: Database, network: Settings, training: Settings, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also in an interrupted run: the rate depends only on the number of samples so far."""
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
    wanted = [settings.learning_rate_share(samples / 2300) for samples in seen]
    assert rates == pytest.approx(wanted[:10])
    del rates[9:]  # the section that was cut short is done again
    rates += [np.nan] * 3
    train(data, network=network, training=settings, checkpoints=tmp_path, threads=1)
    assert rates[12:] == pytest.approx(wanted[9:])


@pytest.mark.parametrize("changes", [FAST, FAST | {"batch": 32, "schedule": "constant"}])
def test_an_interrupted_training_with_a_schedule_ends_with_the_same_bits(
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
    assert torch.equal(whole.adam.second_moment, resumed.adam.second_moment)
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


def test_continues_needs_a_constant_schedule() -> None:
    with pytest.raises(ValueError, match="`continues` needs `schedule: constant`"):
        Training(schedule="cosine", continues="holden")
