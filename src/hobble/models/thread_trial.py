"""A short trial that decides whether a training uses one thread or several.

Two processors of a virtual machine may be one physical core, and the machine does not always say so. Matrix
products then take longer with two threads than with one. Results with another number of threads differ in
their last bits. So `hobble.models.product_trial` stores the choice for later trainings.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import perf_counter, process_time

import torch

from hobble.models.product_trial import REPLACES_BELOW, kept_choice

INPUTS, OUTPUTS = 512, 2048  # size of the product in the trial: a layer of 512 units, four sets of weights
# Single calls are too short to be timed. So as many calls as take about this long with one thread are timed
# together.
SECONDS = 0.01
TURNS = 8  # how often each number of threads is timed
# Least share of the time in which each thread must have a processor. If it is less, other programs used the
# processors during the trial, and the trial says nothing.
UNDISTURBED = 0.9


def threads_for(batch: int, most: int) -> int:
    """The number of threads for batches of `batch` rows: 1 or `most`.

    It is `most` if the machine is busy during the trial, or if the choice cannot be stored. `batch` is
    rounded up to a power of 2, so that similar batches share a choice.
    """
    if most == 1:
        return 1
    rows = 1 << (batch - 1).bit_length()
    ways = ("1", str(most))
    name = f"threads for {rows} rows, at most {most}"
    return int(kept_choice(name, partial(_trial, rows, most), ways, default=ways[1]))


def _trial(rows: int, most: int) -> str:
    """The faster number of threads for products of `rows` rows, "1" or `most`."""
    before = torch.get_num_threads()
    x, w = torch.full((rows, INPUTS), 0.01), torch.full((OUTPUTS, INPUTS), 0.01)
    out = torch.empty(rows, OUTPUTS)
    try:
        return compare(lambda: torch.mm(x, w.T, out=out), most, torch.set_num_threads)
    finally:
        torch.set_num_threads(before)


def compare(
    call: Callable[[], object],
    most: int,
    use: Callable[[int], None],
    clock: Callable[[], float] = perf_counter,
    processor_clock: Callable[[], float] = process_time,
) -> str:
    """The number of threads, "1" or `most`, with which `call` is faster; `most` if the machine is busy.

    use: sets the number of threads. clock, processor_clock: return seconds. The two numbers of threads take
    turns, and the shortest time of each counts.
    """
    best = {threads: (float("inf"), 0.0) for threads in (1, most)}
    calls = 1
    for turn in range(TURNS + 1):
        for threads in best:
            use(threads)
            call()  # wakes the threads
            began, busy = clock(), processor_clock()
            for _ in range(calls):
                call()
            seconds, busy = clock() - began, processor_clock() - busy
            if turn:  # the first turn only finds how many calls are long enough to be timed
                best[threads] = min(best[threads], (seconds, busy / max(seconds, 1e-9)))
            elif threads == 1:
                calls = max(1, round(SECONDS / max(seconds, 1e-6)))
    undisturbed = all(share >= UNDISTURBED * threads for threads, (_, share) in best.items())
    return "1" if undisturbed and best[1][0] < REPLACES_BELOW * best[most][0] else str(most)
