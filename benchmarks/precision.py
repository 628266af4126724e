"""Effect of half precision on disk on the held-out error, compared with the effect of another seed.

    python benchmarks/precision.py [FOLDER] [--passes 3] [--seeds 1 2]

FOLDER has a data set's results with rows (results/datasets/synthetic). They are merged into three databases,
in float32 and in float16. The default network is trained on each, with each seed, by the default
recipe. Accuracy is measured as in the evaluation, on rows that are not rounded. A difference counts only if
it is larger than that between seeds.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from hobble.database.chunks import Manifest
from hobble.database.write import write_database
from hobble.measures.accuracy_run import measure_accuracy
from hobble.measures.measure import MeasureInputs
from hobble.models.pfnn import PfnnOptions
from hobble.training import Training
from hobble.training.train import run

DTYPES = ("float32", "float16")


def trained(database: Path, folder: Path, passes: int, seed: int, threads: int) -> Path:
    """The weights of a network trained on a database."""
    folder.mkdir()
    files = {name: folder / name for name in ("weights", "history", "checkpoint")}
    run(
        database,
        configuration="precision",
        network=PfnnOptions(),
        training=Training(passes=passes, seed=seed),
        checkpoints=folder / "checkpoints",
        threads=threads,
        start=None,
        code=None,
        **files,
    )
    return files["weights"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("results/datasets/synthetic"))
    parser.add_argument("--passes", type=int, default=3)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    made = Manifest.load(arguments.folder / "database/plain")
    splits = {clip["clip"]: clip["split"] for clip in made.clips}
    clips = {name: arguments.folder / f"database/clips/{name}.npz" for name in splits}
    frames = f"{made.row_count('train'):,} frames to learn from, {made.row_count('held_out'):,} held out"
    print(f"{frames}, {arguments.passes} passes")
    print("on disk    share of the original's bytes   seed   held-out error    cm a joint   to float32")
    errors: dict[tuple[str, int], float] = {}
    with tempfile.TemporaryDirectory() as name:
        for dtype in DTYPES:
            database = Path(name, dtype)
            options = {"channels": [], "joint_weight": made.joint_weight, "dtype": dtype}
            manifest = write_database(database, clips, splits, **options)
            for seed in arguments.seeds:
                weights = trained(
                    database, Path(name, f"{dtype}-{seed}"), arguments.passes, seed, arguments.threads
                )
                inputs = MeasureInputs("", {"weights": weights}, clips, splits)
                found = measure_accuracy(inputs)["held_out"]
                errors[dtype, seed] = found["mean"]
                more = found["mean"] / errors["float32", seed] - 1
                print(f"{dtype:<10} {manifest.bytes / manifest.original_bytes:29.1%} {seed:6}", end="")
                print(f"{found['mean']:16.4%} {found['position_error_cm']:13.3f} {more:+12.2%}", flush=True)
    full = np.array([errors["float32", seed] for seed in arguments.seeds])
    if len(full) > 1:
        print(f"between seeds, float32: {np.ptp(full) / full.mean():.2%} from the least to the largest")


if __name__ == "__main__":
    main()
