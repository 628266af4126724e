"""Trainings in float64, alone or as one of those that torchrun started: in_float64.py JOBS.json

So sums in another order differ by 1e-16 of themselves, and other batches by much more. Writes the weights,
the moments and the losses of the sections for each.
"""

import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import torch

from hobble.database.reader import Database
from hobble.models import network_options
from hobble.models.blend import TrainableBlend
from hobble.training import Training
from hobble.training import train as module
from hobble.training.augment import OtherPaces, OtherPoses, RollOut
from hobble.training.batches import HostRows, SampleBatch
from hobble.training.processes import ALONE, Processes, join_processes

WINDOW = Database.chunks_per_window


def widen(kind: Any) -> None:
    plain = kind.batches

    def batches(self: Any, *place: int) -> Any:
        for x, y, p, *rest in plain(self, *place):
            yield SampleBatch(x.double(), y.double(), p.double(), *rest)

    kind.batches = batches


def in_double() -> None:
    """Make networks, batches and carried errors use float64."""
    widen(HostRows)
    to = TrainableBlend.to
    TrainableBlend.to = lambda self, device, dtype=None: to(self, device, torch.float64)  # type: ignore[method-assign]

    for kind in (RollOut, OtherPoses, OtherPaces):
        widen_state(kind)


def widen_state(kind: Any) -> None:
    begin = kind.__init__

    def double(self: Any, *arguments: Any) -> None:
        begin(self, *arguments)
        for name, value in vars(self).items():
            if isinstance(value, torch.Tensor) and value.is_floating_point():
                setattr(self, name, value.double())

    kind.__init__ = double


def main(jobs: list[dict[str, Any]]) -> None:
    in_double()
    if "RANK" not in os.environ:
        for job in jobs:
            one(job, ALONE)
        return
    with join_processes(False) as processes:
        for job in jobs:
            one(job, processes)


def one(job: dict[str, Any], processes: Processes) -> None:
    """window: chunks held at a time, 0 for all."""
    window = job["window"]
    Database.chunks_per_window = (lambda *_: window) if window else WINDOW  # type: ignore[method-assign]
    training = Training.model_validate(job["training"])
    state = module.train(
        Database.open(job["database"], training.memory_mb, training.phase_weight, training.scales),
        network=network_options(job["network"]),
        training=training,
        checkpoints=Path(job["checkpoints"]),
        processes=processes,
    )
    if processes.is_first:
        arrays = {
            "flat": state.network.flat,
            "first": state.adam.first_moment,
            "second": state.adam.second_moment,
        }
        losses = np.array([row[4] for row in state.history])
        np.savez(
            job["out"], losses=losses, steps=state.adam.steps, **{k: v.numpy() for k, v in arrays.items()}
        )


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[1]).read_text()))
