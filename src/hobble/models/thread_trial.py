"""A short trial that decides whether a training uses one thread or several.

Two processors of a virtual machine may be one physical core, and the machine does not always say so. Then
matrix products take longer with two threads than with one. The last bits of the results depend on the number
of threads. So the choice is stored for later trainings (`hobble.models.product_trial`).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from time import perf_counter, process_time

import torch

from hobble.models.product_trial import REPLACES_BELOW, choose_once

# Size of the matrix product in the trial: that of a layer with 512 inputs and four sets of 512 outputs.
INPUTS, OUTPUTS = 512, 2048
# A single product is too short to be timed. So several are timed together: as many as take about this many
# seconds with one thread.
SECONDS = 0.01
TURNS = 8  # how often each number of threads is timed
# If the threads had processors for less than this share of the time, other programs used the processors, and
# the trial shows nothing.
UNDISTURBED = 0.9


def threads_for(batch: int, most: int) -> int:
    """The number of threads with which to train on batches of `batch` rows: 1 or `most`.

    It is `most` if other programs disturb the trial, or if the choice cannot be stored. `batch` is rounded up
    to a power of 2, so that similar batches share a choice.
    """
    if most == 1:
        return 1
    rows = 1 << (batch - 1).bit_length()
    ways = ("1", str(most))
    name = f"threads for {rows} rows, at most {most}"
    return int(choose_once(name, partial(_trial, rows, most), ways, default=ways[1]))


def _trial(rows: int, most: int) -> str:
    """The faster number of threads for products of `rows` rows, "1" or `most`."""
    before = torch.get_num_threads()
    x, w = torch.full((rows, INPUTS), 0.01), torch.full((OUTPUTS, INPUTS), 0.01)
    out = torch.empty(rows, OUTPUTS)
    try:
        return faster_thread_count(lambda: torch.mm(x, w.T, out=out), most, torch.set_num_threads)
    finally:
        torch.set_num_threads(before)


def faster_thread_count(
    call: Callable[[], object],
    most: int,
    set_threads: Callable[[int], None],
    clock: Callable[[], float] = perf_counter,
    processor_clock: Callable[[], float] = process_time,
) -> str:
    """The number of threads, "1" or `most`, with which `call` is faster; `most` if other programs disturb.

    set_threads: sets the number of threads. clock: returns seconds. processor_clock: returns the seconds that
    the process has spent on processors, added up over its threads. Both numbers of threads are timed in turn,
    and the shortest time of each counts.
    """
    # Number of threads -> its shortest time in seconds, and how many processors were in use during that time.
    best = {threads: (float("inf"), 0.0) for threads in (1, most)}
    calls = 1
    for turn in range(TURNS + 1):
        for threads in best:
            set_threads(threads)
            call()  # starts the threads before the clock does
            start, processor_start = clock(), processor_clock()
            for _ in range(calls):
                call()
            seconds, processor_seconds = clock() - start, processor_clock() - processor_start
            if turn:  # the first turn only finds how many calls are long enough to be timed
                best[threads] = min(best[threads], (seconds, processor_seconds / max(seconds, 1e-9)))
            elif threads == 1:
                calls = max(1, round(SECONDS / max(seconds, 1e-6)))
    undisturbed = all(in_use >= UNDISTURBED * threads for threads, (_, in_use) in best.items())
    return "1" if undisturbed and best[1][0] < REPLACES_BELOW * best[most][0] else str(most)
