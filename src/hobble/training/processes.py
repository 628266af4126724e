"""The processes that train one network together: who each is, and what they tell each other.

Each has all the weights and finds the gradient on its own rows of a batch. The gradients are summed over the
processes, so that all take the same step. They are started by `hobble.training.launch`; alone there is
nothing to tell, and PyTorch's engine is not loaded.
"""

from __future__ import annotations

import contextlib
import os
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import timedelta
from typing import Any

import torch
import torch.distributed
from torch import Tensor

from hobble.core.errors import HobbleError
from hobble.database.stretches import Sharing, own_places

PATIENCE = timedelta(minutes=30)  # for the slowest process; one that died is noticed at once


@dataclass(frozen=True)
class Processes:
    """Process `rank`, from 0, of `count`; `local` is its number on its machine."""

    rank: int = 0
    count: int = 1
    local: int = 0

    @property
    def first(self) -> bool:
        """Whether it is the one that writes files and tells how it goes."""
        return self.rank == 0

    @property
    def alone(self) -> bool:
        """Whether there is no other."""
        return self.count == 1

    def places(self, batch: int) -> range:
        """The places in a batch that it fills."""
        return own_places(batch, self.rank, self.count)

    def sharing(self, total: int, batch: int, stretches: int | None) -> Sharing:
        """What it reads of a section; where `stretches` is None there are as many as processes."""
        return Sharing.of(total, batch, stretches or self.count, self.rank, self.count)

    def sum(self, values: Tensor) -> None:
        """Replace values (n,) by their sum over the processes, which is the same to the bit in each."""
        if not self.alone:
            torch.distributed.all_reduce(values)

    def take_from_first(self, *tensors: Tensor) -> None:
        """Replace tensors by those of the first process."""
        if not self.alone:
            for tensor in tensors:
                torch.distributed.broadcast(tensor, 0)

    def numbers_of_first(self, *numbers: int) -> list[int]:
        """The first process's numbers."""
        shared: list[Any] = [numbers]
        if not self.alone:
            torch.distributed.broadcast_object_list(shared, 0)
        return list(shared[0])

    def best_told(self, text: str, certain: bool) -> str:
        """The text of the first process that is certain of it; else that of the first process."""
        if self.alone:
            return text
        told: list[Any] = [None] * self.count
        torch.distributed.all_gather_object(told, (not certain, text))
        return str(min(enumerate(told), key=lambda one: (one[1][0], one[0]))[1][1])

    def check_same(self, flat: Tensor) -> None:
        """Raise HobbleError where the processes have come to hold different weights."""
        if self.alone:
            return
        sums: list[Any] = [None] * self.count
        torch.distributed.all_gather_object(sums, zlib.crc32(flat.cpu().numpy().tobytes()))
        if len(set(sums)) > 1:
            raise HobbleError(
                "the processes that train together hold different weights. The last checkpoint is kept. "
                "They need the same kind of processor, the same PyTorch and the same database."
            )


ALONE = Processes()


@contextlib.contextmanager
def joined(on_cuda: bool) -> Iterator[Processes]:
    """This process among those that torchrun started: over NCCL on GPUs, over gloo on CPUs."""
    numbers = (int(os.environ[name]) for name in ("RANK", "WORLD_SIZE", "LOCAL_RANK"))
    processes = Processes(*numbers)
    if on_cuda:
        torch.cuda.set_device(processes.local)
    torch.distributed.init_process_group("nccl" if on_cuda else "gloo", timeout=PATIENCE)
    try:
        yield processes
    finally:
        torch.distributed.destroy_process_group()
