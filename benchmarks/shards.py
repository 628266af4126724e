"""A database of many shards against one from one job: time to make it, change it, read it and train from it.

    python benchmarks/shards.py [--size-mb 512] [--shards 8] [--memory-mb 64] [--rounds 5] [--folder DIR]

Builds both databases from the same made-up rows, then makes one shard again and merges, as after a new clip.
Reads both within `memory-mb`, and takes steps of the real training from both, in turns. Everything is
processor time, so that other work on the machine matters little. The reader changes the rows of each shard to
the statistics of the whole database; the ratios show what that costs.
"""

from __future__ import annotations

import argparse
import os
import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from database import made_up

from hobble.config.sections import Training
from hobble.core.processors import processor_name
from hobble.database.reader import Database
from hobble.database.write import merge_shards, write_database, write_shard
from hobble.models.pfnn import PfnnOptions
from hobble.training.batches import HostRows
from hobble.training.checkpoint import new_state, step_for, use_threads
from hobble.training.optimiser import update_for

SAMPLES = 50_000  # of a turn of reading; a tenth of them in a turn of training
OPTIONS = {"channels": ["injury"], "joint_weight": 0.1}


def timed(work: Callable[[], object]) -> float:
    """Processor seconds of some work, of all threads."""
    start = time.process_time()
    work()
    return time.process_time() - start


def built(folder: Path, size_mb: int, shards: int) -> tuple[Path, Path]:
    """The database of one job and that of shards. Prints how long they took."""
    files = made_up(folder / "clips", size_mb << 20, 31)
    splits = dict.fromkeys(files, "train")
    one, many = folder / "one", folder / "many"
    whole = timed(lambda: write_database(one, files, splits, **OPTIONS))
    folders = [folder / "shards" / str(n) for n in range(shards)]
    groups = [dict(list(files.items())[n::shards]) for n in range(shards)]

    def shard(n: int) -> None:
        write_shard(folders[n], groups[n], splits, **OPTIONS)

    def merge() -> None:
        merge_shards(many, folders, joint_weight=0.1)

    each, join = [timed(lambda n=n: shard(n)) for n in range(shards)], timed(merge)
    again = timed(lambda: shard(0)) + timed(merge)
    print(f"one job {whole:.2f} s; {shards} shards {sum(each):.2f} s, merge {join:.2f} s")
    print(f"after a change of one clip: {again:.2f} s, {again / whole:.3f} of one job")
    return one, many


def turns(dbs: dict[str, Database], rounds: int, turn: Callable[[Database, int], float]) -> str:
    """Rates of both databases and their ratio, medians over rounds in alternating order."""
    found = [{name: turn(dbs[name], n) for name in list(dbs)[:: 1 - 2 * (n % 2)]} for n in range(rounds + 1)]
    one, many = (np.array([rates[name] for rates in found[1:]]) for name in dbs)
    return f"{np.median(one):,.0f} from one, {np.median(many):,.0f} from shards, {np.median(many / one):.3f}"


def read(db: Database, section: int) -> float:
    """Rows a second of reading."""
    start, rows = time.process_time(), 0
    for block in db.blocks("train", 0, section % 10, 10, 1, db.block_rows(32)):
        rows += len(block.p)
        if rows >= SAMPLES:
            break
    return rows / (time.process_time() - start)


def trainer(db: Database) -> Callable[[Database, int], float]:
    """Takes steps of a training and returns the samples a second."""
    options = Training()
    state = new_state(db, PfnnOptions(), options)
    update = update_for(step_for(state.network, options), state.adam, options.batch)

    def turn(db: Database, section: int) -> float:
        start, rows = time.process_time(), 0
        for batch in HostRows(db, state.network.flat.device).batches(0, section % 10, 10, 1, options.batch):
            update(*batch[:3], 1.0)
            rows += len(batch.p)
            if rows >= SAMPLES // 10:
                break
        return rows / (time.process_time() - start)

    return turn


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size-mb", type=int, default=512)
    parser.add_argument("--shards", type=int, default=8)
    parser.add_argument("--memory-mb", type=int, default=64)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--folder", type=Path)
    arguments = parser.parse_args()
    print(processor_name())
    use_threads(int(os.environ.get("OMP_NUM_THREADS", "2")))
    folder = Path(tempfile.mkdtemp(prefix="hobble-shards-", dir=arguments.folder))
    try:
        one, many = built(folder, arguments.size_mb, arguments.shards)
        dbs = {
            "one": Database.open(one, arguments.memory_mb),
            "shards": Database.open(many, arguments.memory_mb),
        }
        print(f"reading within {arguments.memory_mb} MB, rows a second: {turns(dbs, arguments.rounds, read)}")
        print(f"training, samples a second: {turns(dbs, arguments.rounds, trainer(dbs['one']))}")
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
