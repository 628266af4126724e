"""Training on a GPU: samples a second with rows composed there, and those of the products alone, in one run.

    python benchmarks/training_cuda.py [--batches 32,256,4096] [--seconds 5] [--device cuda]

Each line is the loop of `hobble.training.train` on a made-up database on the device, with rows like those of
`holden`: composing, dropout, gradient, Adam, check of the losses; without held-out errors and checkpoints. Up
to a batch of `CAPTURED_UP_TO` a step is one captured graph. `plain` is the same with single kernels. `floor`
is the time of the matrix products alone in the same precision. The last column is the time of the original's
whole training (20 passes of 4.66 million samples).
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import hobble.training  # noqa: F401 - first, since it says how threads wait
from hobble.core.processors import processor_name

# isort: split
import torch
from database import made_up
from training import L1, RATE, Batch, fresh, products

from hobble.config.sections import Training
from hobble.database.reader import Database
from hobble.database.write import write_database
from hobble.models.pfnn import PfnnOptions
from hobble.training.batches import LossWatch
from hobble.training.checkpoint import step_for, use_threads
from hobble.training.device_rows import DeviceRows
from hobble.training.optimiser import Adam, Update, update_for

WHOLE = 93_198_000  # samples: 465,990 frames, ten fits, 20 passes
SECTIONS = 10
PRECISIONS = ("float32", "tf32", "bfloat16")


def samples(rows: DeviceRows, size: int, update: Update) -> Iterator[int]:
    """Trains batch by batch, section by section; yields how many samples each batch had."""
    for turn in range(1_000_000):
        watch = LossWatch("the benchmark", rows.database.clips)
        update.step.seed(turn)
        for batch in rows.batches(*divmod(turn, SECTIONS), SECTIONS, 1, size):
            watch.add(update(*batch[:3], 1.0), batch)
            yield len(batch.p)
        watch.mean()


def alone(work: Callable[[Batch], None], batch: Batch) -> Iterator[int]:
    while True:
        work(batch)
        yield len(batch[0])


def speed(counts: Iterator[int], seconds: float, device: torch.device) -> float:
    """Samples a second after warming up, until all kernels have ended."""
    wait = torch.cuda.synchronize if device.type == "cuda" else lambda: None
    for _ in range(20):
        next(counts)
    wait()
    start, total = time.perf_counter(), 0
    while time.perf_counter() - start < seconds:
        total += sum(next(counts) for _ in range(20))
        wait()
    return total / (time.perf_counter() - start)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--batches", default="32,256,4096")
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--size-mb", type=int, default=300, help="of the database")
    options = parser.parse_args()
    print(processor_name())
    device = torch.device(options.device)
    use_threads(2)
    network = PfnnOptions()
    with tempfile.TemporaryDirectory() as folder:
        files = made_up(Path(folder), options.size_mb << 20, joints=31)
        write_database(
            Path(folder) / "database", files, dict.fromkeys(files, "train"), channels=[], joint_weight=0.1
        )
        rows = DeviceRows(Database.open(Path(folder) / "database"), device)
    layout = rows.database.layout
    sizes = (layout.x_size, *[network.units] * network.hidden_layers, layout.y_size)
    name = torch.cuda.get_device_name() if device.type == "cuda" else "a CPU"
    print(f"{'-'.join(map(str, sizes))} on {name}")
    print("  batch  precision   samples/s    plain    floor   minutes for the whole of holden")
    for size in map(int, options.batches.split(",")):
        for precision in PRECISIONS:
            training = Training(batch=size, precision=precision)
            found = []
            for way in (update_for, lambda step, adam, _: Update(step, adam)):
                made = fresh(sizes).to(device)
                step, adam = step_for(made, training), Adam(made, RATE, 0.9, 0.999, L1)
                found.append(speed(samples(rows, size, way(step, adam, size)), options.seconds, device))
            batch = tuple(torch.zeros(size, *tail, device=device) for tail in ((sizes[0],), (sizes[-1],), ()))
            work = products(precision == "bfloat16", sizes, device)
            floor = speed(alone(work, batch), options.seconds / 2, device)
            numbers = f"{found[0]:11,.0f} {found[1]:8,.0f} {floor:8,.0f}"
            print(f"{size:7} {precision:>10} {numbers} {WHOLE / found[0] / 60:10.1f}", flush=True)


if __name__ == "__main__":
    main()
