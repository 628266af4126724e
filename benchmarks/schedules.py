"""The time until one recipe reaches the final held-out error of another; trains both in one run.

    python benchmarks/schedules.py DATABASE [--configurations holden,fast] [--plot curves.png] [--threads 2]

DATABASE is a database folder, such as results/datasets/synthetic/database/plain. Each configuration is
trained on it from the start to the end. The curves are the held-out errors of history.csv over its seconds,
which include measuring and checkpoints. CPU seconds of the process are printed too, because they depend less
on other work on the machine.
"""

import argparse
import logging
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import hobble.training  # noqa: F401 - first, since it says how threads wait
from hobble.core.processors import processor_name

# isort: split
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import torch

from hobble.config.load_configuration import Catalogue
from hobble.database.reader import Database
from hobble.training.batches import HeldOutErrors
from hobble.training.checkpoint import State
from hobble.training.train import train

ROOT = Path(__file__).resolve().parents[1]


class Curve(NamedTuple):
    """The curve of one recipe: seconds and held-out error after each section. whole: the error of every row
    at the end.
    """

    name: str
    wall: list[float]
    cpu: list[float]
    error: list[float]
    whole: float


class CpuSeconds(logging.Handler):
    """Records the CPU seconds of the process at each progress message of the training."""

    def __init__(self) -> None:
        super().__init__(logging.INFO)
        self.start, self.seconds = time.process_time(), []

    def emit(self, record: logging.LogRecord) -> None:
        """Called by `logging` for each message."""
        if "samples/s" in record.getMessage():
            self.seconds.append(time.process_time() - self.start)


def trained(name: str, database: Path, threads: int) -> Curve:
    configuration = Catalogue(ROOT / "config").configuration(name)
    network = configuration.network
    training = configuration.training
    data = Database.open(database, training.memory_mb)
    log, clock = logging.getLogger("hobble.training"), CpuSeconds()
    log.setLevel(logging.INFO)
    log.addHandler(clock)
    with tempfile.TemporaryDirectory() as folder:
        state: State = train(
            data, network=network, training=training, checkpoints=Path(folder), threads=threads
        )
    log.removeHandler(clock)
    whole = HeldOutErrors(data, torch.device("cpu"), 0).errors(state.network, every_row=True)[0]
    wall, error = ([row[column] for row in state.history] for column in (3, 5))
    print(
        f"{name:12} {state.samples:11,} samples, {state.adam.steps:9,} steps, {wall[-1]:7.1f} s "
        f"({clock.seconds[-1]:.1f} s CPU): held out {whole:.4f}, at best {min(state.held_out_errors):.4f}",
        flush=True,
    )
    return Curve(name, wall, clock.seconds, error, whole)


def reached(curve: Curve, error: float) -> int | None:
    """The first section from which on the error stays at or below `error`."""
    above = [number for number, value in enumerate(curve.error) if value > error]
    first = above[-1] + 1 if above else 0
    return first if first < len(curve.error) else None


def draw(curves: list[Curve], path: Path) -> None:
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), constrained_layout=True)
    for axis, clock in zip(axes, ("wall", "cpu"), strict=True):
        for curve in curves:
            axis.plot(getattr(curve, clock), curve.error, label=curve.name)
        axis.axhline(curves[0].error[-1], color="0.6", linewidth=0.8, linestyle=":")
        axis.set(xscale="log", yscale="log", xlabel=f"{clock} seconds", ylabel="held-out mean squared error")
        axis.grid(which="both", alpha=0.25)
        axis.legend()
    figure.savefig(path, dpi=130)
    print(f"drawn: {path}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("database", type=Path)
    parser.add_argument("--configurations", default="holden,fast")
    parser.add_argument("--plot", type=Path)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    print(processor_name())
    curves = [trained(name, options.database, options.threads) for name in options.configurations.split(",")]
    first = curves[0]
    for curve in curves[1:]:
        at = reached(curve, first.error[-1])
        if at is None:
            print(f"{curve.name} ends at {curve.error[-1]:.4f} and does not reach {first.error[-1]:.4f}")
            continue
        wall, cpu = curve.wall[at] / first.wall[-1], curve.cpu[at] / first.cpu[-1]
        whole = curve.wall[-1] / first.wall[-1]
        print(
            f"{curve.name} reaches the {first.error[-1]:.4f} of {first.name} after 1/{1 / wall:.1f} of its "
            f"wall time (1/{1 / cpu:.1f} of its CPU time); all of it takes 1/{1 / whole:.1f}"
        )
    if options.plot:
        draw(curves, options.plot)


if __name__ == "__main__":
    main()
