"""Samples a second of 1, 2, ... processes that train together, and the cost of a network connection.

    python benchmarks/training_processes.py [--processes 1,2] [--batches 32,256,1024] [--turns 3]
        [--sizes 342,512,512,311]

Each process has one thread and takes its part of a batch; the gradients are summed over loopback (gloo). In
each turn, every number of processes is timed; the best turn counts. The second table is computed, not
measured: a ring all-reduce sends 2 (n - 1) / n of the gradient through the slowest link, in 2 (n - 1)
messages.
"""

import argparse
import json
import os
import subprocess
import sys
import time

import hobble.training  # noqa: F401 - first, since it says how threads wait
from hobble.core.processors import processor_name

# isort: split
import torch
from training import fresh

from hobble.training import Training
from hobble.training.checkpoint import step_for, use_threads
from hobble.training.optimiser import Adam, Update
from hobble.training.processes import ALONE, Processes, join_processes

SECONDS = 1.0
LINKS = {
    "10 Gb/s Ethernet": (1.25e9, 30e-6),
    "25 Gb/s": (3.1e9, 20e-6),
    "100 Gb/s InfiniBand": (12.5e9, 5e-6),
}


def measure_step(processes: Processes, sizes: tuple[int, ...], batch: int) -> tuple[float, float]:
    """Seconds of a step, and of the sum in it."""
    network = fresh(sizes)
    adam = Adam(network, 1e-4, 0.9, 0.999, 0.01)
    step = step_for(network, Training(batch=batch), False)
    step.seed(1)
    update = Update(step, adam, batch, processes)
    own = len(processes.own_places(batch))
    x, y, p = torch.randn(own, sizes[0]), torch.randn(own, sizes[-1]), torch.rand(own)
    sent = torch.zeros(len(network.flat) + 1)

    def seconds(work: object) -> float:
        calls, start = 0, time.perf_counter()
        more = torch.ones(1)
        while more.item() > 0:
            for _ in range(max(1, 512 // batch)):
                work()  # type: ignore[operator]
                calls += 1
            more.fill_(float(processes.is_first and time.perf_counter() - start < SECONDS))
            processes.sum(more)
        return (time.perf_counter() - start) / calls

    seconds(lambda: update(x.clone(), y, p, 1.0, batch))  # compile, and choose algorithms
    whole = seconds(lambda: update(x.clone(), y, p, 1.0, batch))
    return whole, seconds(lambda: processes.sum(sent)) if not processes.is_alone else 0.0


def work(sizes: tuple[int, ...], batches: list[int]) -> None:
    """What each of the processes does; the first prints."""
    use_threads(1)
    if "RANK" not in os.environ:
        print(json.dumps([measure_step(ALONE, sizes, batch) for batch in batches]))
        return
    with join_processes(False) as processes:
        found = [measure_step(processes, sizes, batch) for batch in batches]
    if processes.is_first:
        print(json.dumps(found))


def started(processes: int, options: argparse.Namespace) -> list[tuple[float, float]]:
    start = ["-m", "torch.distributed.run", "--standalone", f"--nproc-per-node={processes}"]
    given = ["--batches", options.batches, "--sizes", options.sizes, "--work"]
    command = [sys.executable, *(start if processes > 1 else []), __file__, *given]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    out = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment)
    return [tuple(pair) for pair in json.loads(out.stdout.splitlines()[-1])]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--processes", default="1,2")
    parser.add_argument("--batches", default="32,256,1024")
    parser.add_argument("--sizes", default="342,512,512,311")
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--work", action="store_true", help="be one of the processes")
    options = parser.parse_args()
    print(processor_name())
    sizes = tuple(int(size) for size in options.sizes.split(","))
    batches = [int(batch) for batch in options.batches.split(",")]
    if options.work:
        work(sizes, batches)
        return
    counts = [int(count) for count in options.processes.split(",")]
    turns = [{count: started(count, options) for count in counts} for _ in range(options.turns)]
    print(
        "| batch | processes | samples/s | times one | ms a step | of it the sum |\n|---|---|---|---|---|---|"
    )
    for number, batch in enumerate(batches):
        best = {count: min(turn[count][number] for turn in turns) for count in counts}
        for count, (whole, total) in best.items():
            numbers = f"{batch / whole:,.0f} | {best[counts[0]][0] / whole:.2f}"
            print(f"| {batch} | {count} | {numbers} | {1e3 * whole:.2f} | {1e3 * total:.2f} |")
    on_paper(4 * (len(fresh(sizes).flat) + 1))


def on_paper(sent: int) -> None:
    """Milliseconds that a step waits for the network, by its bytes and the messages of a ring."""
    print(f"\n{sent / 1e6:.2f} MB of gradient a step\n")
    print("| ms a step, nodes | 2 | 8 | 32 | 80 |\n|---|---|---|---|---|")
    for name, (rate, delay) in LINKS.items():
        cells = [2e3 * (n - 1) * (sent / n / rate + delay) for n in (2, 8, 32, 80)]
        print(f"| {name} | {' | '.join(f'{cell:.1f}' for cell in cells)} |")


if __name__ == "__main__":
    main()
