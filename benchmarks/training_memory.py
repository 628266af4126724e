"""Peak memory of a training, on databases smaller and larger than its `memory_mb`.

    python benchmarks/training_memory.py [--sizes-mb 100,1200] [--configuration holden] [--folder DIR]

Each training is a separate process with three short sections, including blocks, windows, measuring and
checkpoints, as in a whole run. The script prints the peak resident memory from Linux, and the memory before
the first batch: Python, PyTorch and compiled loops.
"""

import argparse
import contextlib
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

SAMPLES = 20_000  # of a section
TURNS = 3
ROOT = Path(__file__).resolve().parents[1]


def peak_mb() -> float:
    """Of this process so far."""
    status = Path("/proc/self/status").read_text()
    return int(status.split("VmHWM:")[1].split()[0]) / 1024


def child(database: Path, configuration: str) -> None:
    """Train for a while; prints the database's size and the peaks, in MB."""
    from hobble.config.load_configuration import Catalogue
    from hobble.database.reader import Database
    from hobble.training.train import train

    model = Catalogue(ROOT / "config").configuration(configuration)
    data = Database.open(database, model.training.memory_mb)
    sections = max(1, data.sample_count("train") // SAMPLES)
    training = model.training.model_copy(update={"passes": 1, "sections": sections})
    before = peak_mb()

    class Enough(Exception):
        pass

    from hobble.training import train as module

    saved = iter(range(TURNS))
    report = module.Progress.report

    def counted(self: module.Progress, *arguments: object) -> None:
        report(self, *arguments)
        if next(saved) == TURNS - 1:
            raise Enough

    module.Progress.report = counted  # type: ignore[method-assign]
    with tempfile.TemporaryDirectory() as folder, contextlib.suppress(Enough):
        train(
            data,
            network=model.network,
            training=training,
            checkpoints=Path(folder),
            threads=2,
        )
    facts = (data.manifest.bytes / 2**20, training.memory_mb, training.batch, before, peak_mb())
    print(json.dumps(facts))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--sizes-mb", default="100,1200")
    parser.add_argument("--configuration", default="holden")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--child", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.child:
        child(options.child, options.configuration)
        return
    from database import made_up

    from hobble.database.write import write_database

    print("database MB   memory_mb   batch   before training MB   peak MB")
    for size in map(int, options.sizes_mb.split(",")):
        folder = Path(tempfile.mkdtemp(dir=options.folder))
        try:
            files = made_up(folder, size << 20, joints=31)
            splits = dict.fromkeys(files, "train") | {next(iter(files)): "held_out"}
            write_database(folder / "database", files, splits, channels=[], joint_weight=0.1)
            command = [sys.executable, __file__, "--child", str(folder / "database")]
            command += ["--configuration", options.configuration]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            facts = json.loads(done.stdout.splitlines()[-1])
            print("{:11,.0f} {:11,.0f} {:7,.0f} {:20,.0f} {:9,.0f}".format(*facts), flush=True)
        finally:
            shutil.rmtree(folder)


if __name__ == "__main__":
    main()
