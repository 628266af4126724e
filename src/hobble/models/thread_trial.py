"""Whether a training takes one thread or several, by a short trial.

A virtual machine may have two processors that are one core, and does not always say so. Products then take
longer with two threads than with one. Results with another number of threads differ in their last bits, so
the choice is kept like those of `hobble.models.product_trial`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import perf_counter, process_time

import torch

from hobble.models.product_trial import GAIN, kept_choice

INPUTS, OUTPUTS = 512, 2048  # of the product in the trial: a layer of 512 units at four control points
SECONDS = 0.01  # of the calls that are timed together, since threads take time to start
TURNS = 8  # of each number of threads
# Processor seconds of each thread in a second. If they are fewer, other work took the processors meanwhile,
# and the trial says nothing.
UNDISTURBED = 0.9


def threads_for(batch: int, most: int) -> int:
    """The number of threads for batches of this size: 1, or `most` of them.

    `most` if the machine is busy during the trial, or if the choice cannot be kept. Batches of nearly the
    same size share a choice.
    """
    if most == 1:
        return 1
    rows = 1 << (batch - 1).bit_length()
    ways = ("1", str(most))
    name = f"threads for {rows} rows, at most {most}"
    return int(kept_choice(name, partial(_trial, rows, most), ways, without=ways[1]))


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

    use: sets the number of threads. The two take turns, and the shortest time of each counts.
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
            if turn:  # the first turn only says how many calls take long enough
                best[threads] = min(best[threads], (seconds, busy / max(seconds, 1e-9)))
            elif threads == 1:
                calls = max(1, round(SECONDS / max(seconds, 1e-6)))
    undisturbed = all(share >= UNDISTURBED * threads for threads, (_, share) in best.items())
    return "1" if undisturbed and best[1][0] < GAIN * best[most][0] else str(most)
