"""Compares a network trained with injuries and one trained without, by the same recipe, on healthy motion.

    snakemake -c2 results/limp/network/weights.npz
    snakemake -c2 results/holden/network/weights.npz --config training=limp
    python benchmarks/hurt_and_healthy.py results/limp results/holden DATABASE

DATABASE is results/datasets/synthetic/database/plain. Errors of one step and of roll-outs on its healthy
clips, waypoints of the track, ten minutes of walks, jogs, crouches and turns, and the processor time of the
trainings. The last column is the first network's value divided by the second's.
"""

import argparse
import csv
from pathlib import Path

from stability import stability

from hobble.core.processors import processor_name
from hobble.database.reader import Database
from hobble.measures.accuracy_run import measure_accuracy
from hobble.measures.measure import MeasureInputs
from hobble.measures.responsivity import Options as Laps
from hobble.measures.responsivity_run import measure_responsivity
from hobble.models.load import load_network
from hobble.runtime import Runtime
from hobble.training import Training

LENGTHS = (1, 10, 60, 300)


def training_seconds(folder: Path) -> float | None:
    """Processor seconds of the training, as the workflow measured them."""
    file = folder / "benchmarks/training/training.tsv"
    if not file.exists():
        return None
    with file.open() as lines:
        return sum(float(row["cpu_time"]) for row in csv.DictReader(lines, delimiter="\t"))


def values(folder: Path, files: dict[str, Path], splits: dict[str, str], minutes: float) -> dict[str, object]:
    """The row of values of one network, by name."""
    weights = folder / "network/weights.npz"
    network = load_network(weights)
    out: dict[str, object] = {}
    inputs = MeasureInputs(folder.name, {"weights": weights}, files, splits)
    found = measure_accuracy(inputs, lengths=LENGTHS)
    for split in ("train", "held_out"):
        out[f"{split}: one step, share"] = found[split]["mean"]
        out[f"{split}: one step, cm"] = found[split]["position_error_cm"]
        for row in found["rollouts"]:
            out[f"{split}: {row['length']} frames, cm"] = row[split]["position_error_cm"]
    lap = measure_responsivity(network, Laps(laps=1, modes=()), configuration="", runtime=Runtime())
    out["waypoints"] = f"{lap['waypoints_reached']} of {lap['waypoints']}"
    out["off the path, cm"] = lap["path_overshoot_cm"]
    stable = stability(network, minutes)
    out["hips, cm"] = f"{stable['hips_lowest_cm']:.0f} to {stable['hips_highest_cm']:.0f}"
    out["largest turn, degrees"] = stable["largest_turn_degrees"]
    out["foot slide, cm a step"] = stable["foot_slide_cm"]
    out["training, processor s"] = training_seconds(folder)
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("hurt", type=Path, help="results of the configuration with injuries")
    parser.add_argument("healthy", type=Path, help="results of the one without")
    parser.add_argument("database", type=Path, help="the database of healthy clips")
    parser.add_argument("--minutes", type=float, default=10.0)
    arguments = parser.parse_args()
    print(processor_name())
    database = Database.open(arguments.database, Training().memory_mb)
    splits = {c["clip"]: c["split"] for c in database.manifest.clips if c["rows"]}
    files = {name: arguments.database.parent / "clips" / f"{name}.npz" for name in splits}
    hurt, healthy = (
        values(folder, files, splits, arguments.minutes) for folder in (arguments.hurt, arguments.healthy)
    )
    print(f"{'':28}{arguments.hurt.name:>12}{arguments.healthy.name:>12}{'ratio':>8}")
    for name, value in hurt.items():
        other = healthy[name]
        if isinstance(value, float) and isinstance(other, float) and other:
            print(f"{name:28}{value:12.4g}{other:12.4g}{value / other:8.2f}")
        else:
            print(f"{name:28}{value!s:>12}{other!s:>12}")


if __name__ == "__main__":
    main()
