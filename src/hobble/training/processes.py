"""Several processes that train one network together, and their communication.

Each process has all the weights and computes the gradient on its own rows of a batch. The gradients are
summed over the processes, so that all take the same step. torchrun starts the processes. A single process
does not communicate and does not start torch.distributed.
"""

import contextlib
import os
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import timedelta
from typing import Any, TypeVar

import torch
import torch.distributed
from torch import Tensor

from hobble.core.errors import HobbleError
from hobble.database.order import own_part

Numbers = TypeVar("Numbers")
LONGEST_WAIT = timedelta(minutes=30)  # for the slowest process; a dead process is noticed at once


@dataclass(frozen=True)
class Processes:
    """A group of `count` processes, as one of them sees it.

    rank: number of this process, from 0. local_rank: its number among the processes of its machine, from 0.
    """

    rank: int = 0
    count: int = 1
    local_rank: int = 0

    @property
    def is_first(self) -> bool:
        """Whether this is the first process, which writes the files and the log."""
        return self.rank == 0

    @property
    def is_alone(self) -> bool:
        """Whether there is only one process."""
        return self.count == 1

    def own_places(self, batch: int) -> range:
        """The places in a batch that this process fills."""
        return own_part(batch, self.rank, self.count)

    def sum(self, values: Tensor) -> None:
        """Replace values (n,) by their sum over the processes. All processes get the same bits."""
        if not self.is_alone:
            torch.distributed.all_reduce(values)

    def take_from_first(self, tensors: Iterable[Tensor], numbers: Numbers) -> Numbers:
        """Replace the tensors by those of the first process. Returns the numbers that it passes."""
        shared: list[Any] = [numbers]
        if not self.is_alone:
            for tensor in tensors:
                torch.distributed.broadcast(tensor, 0)
            torch.distributed.broadcast_object_list(shared, 0)
        return shared[0]  # type: ignore[no-any-return]

    def check_same(self, flat: Tensor) -> None:
        """Raise HobbleError if the processes hold different weights. flat: the weights of this process."""
        if self.is_alone:
            return
        checksums: list[Any] = [None] * self.count
        torch.distributed.all_gather_object(checksums, zlib.crc32(flat.cpu().numpy().tobytes()))
        if len(set(checksums)) > 1:
            raise HobbleError(
                "the processes that train together hold different weights. The last checkpoint is kept. "
                "Give all processes the same kind of processor, the same PyTorch and the same database."
            )


ALONE = Processes()


@contextlib.contextmanager
def join_processes(on_cuda: bool) -> Iterator[Processes]:
    """Connect this process with the others that torchrun started: by NCCL on GPUs, by gloo on CPUs."""
    numbers = (int(os.environ[name]) for name in ("RANK", "WORLD_SIZE", "LOCAL_RANK"))
    processes = Processes(*numbers)
    if on_cuda:
        torch.cuda.set_device(processes.local_rank)
    torch.distributed.init_process_group("nccl" if on_cuda else "gloo", timeout=LONGEST_WAIT)
    try:
        yield processes
    finally:
        torch.distributed.destroy_process_group()
