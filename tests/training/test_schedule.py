"""The learning rate follows the configured schedule."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from hobble.database.reader import Database
from hobble.training.optimiser import Adam
from hobble.training.train import train

Settings = dict[str, Any]
FAST = {"schedule": "cosine", "warm_up": 0.5, "rollout": 4, "batch": 300}


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
