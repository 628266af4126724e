"""Speed, size and memory of the database, as ratios measured in one run.

    python benchmarks/database.py [--size-mb 1280] [--memory-mb 128] [--folder DIR] [--joints 31]

Builds a database of made-up rows of `size-mb`, half of them flat and half with ten fits. Reads it from disk
within `memory-mb`, from memory, and with simpler methods for comparison. Before reading from disk, the page
cache is dropped. If possible, reading runs in a memory cgroup of `memory-mb` plus the program's own memory,
which limits the page cache too.
"""

import argparse
import os
import resource
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from own_process import arguments, child, cold, status

from hobble.core.processors import processor_name
from hobble.database.reader import Database
from hobble.database.write import write_database
from hobble.rows.clip_rows import ClipRows, save_clip_rows
from hobble.rows.layout import RowLayout

CLIP_ROWS = 3000
BATCH = 512
WINDOWS = 3  # windows of the reader in a turn of training
STACK = 8 << 20
PROGRAM_MB = 100  # Python, numpy and some room for the page cache
SECONDS = 6.0  # of reading, per measurement


def made_up(folder: Path, size: int, joints: int) -> dict[str, Path]:
    """Files of random rows, about `size` bytes in all."""
    layout = RowLayout(joints, channels=(("injury", 30),))
    parents = {f"j{i}": f"j{i - 1}" if i else None for i in range(joints)}
    bones = {name: {"parent": parent, "offset": [0.0, 1.0, 0.0]} for name, parent in parents.items()}
    skeleton = {"name": "made up", "joints": bones, "roles": {}}
    files, total, rng = {}, 0, np.random.default_rng(0)
    while total < size:
        fits = 1 if len(files) % 2 else 10
        shapes = {
            "x": (CLIP_ROWS, layout.x_terrain.start),
            "y": (CLIP_ROWS, layout.y_size),
            "p": (CLIP_ROWS,),
            "heights": (CLIP_ROWS * fits, 36),
            "mean": (CLIP_ROWS * fits,),
        }
        arrays = {name: rng.standard_normal(shape, np.float32) for name, shape in shapes.items()}
        channels = {"injury": rng.standard_normal((CLIP_ROWS, 30), np.float32)}
        count = np.full(CLIP_ROWS, fits)
        frame = np.arange(CLIP_ROWS)
        name = f"clip{len(files):04d}"
        rows = ClipRows(
            name, layout, skeleton, frame=frame, cycle=frame // 60, fits=count, channels=channels, **arrays
        )
        files[name] = folder / f"{name}.npz"
        save_clip_rows(files[name], rows)
        total += files[name].stat().st_size
    return files


def rate(batches: Iterator[int], seconds: float = SECONDS) -> float:
    """Rows a second of an iterator of row counts, without its first batch (compiling, loading)."""
    next(batches)
    start, rows = time.perf_counter(), 0
    for n in batches:
        rows += n
        if time.perf_counter() - start > seconds:
            break
    return rows / (time.perf_counter() - start)


def of_database(db: Database) -> Iterator[int]:
    """Yields the rows of each block, section after section."""
    rows = db.block_rows(BATCH)
    for section in range(1_000_000):
        for block in db.blocks("train", section // 10, section % 10, 10, 1, rows):
            yield len(block.p)


def write_expanded(db: Database, path: Path, rows: int) -> None:
    """The original's layout: a row of X, Y and P in float32 for every pair."""
    with open(path, "wb") as file:
        for section in range(1_000_000):
            for block in db.blocks("train", 0, section, 10, 1):
                n = min(len(block.p), rows)
                file.write(np.concatenate([block.x, block.y, block.p[:, None]], axis=1)[:n].tobytes())
                rows -= n
                if not rows:
                    return


def random_rows(table: np.memmap) -> Iterator[int]:
    """Batches of random rows, like a data loader over a memory map."""
    rng = np.random.default_rng(1)
    while True:
        yield len(np.array(table[np.sort(rng.integers(0, len(table), BATCH))]))


def shuffled_pieces(table: np.memmap, rows: int) -> Iterator[int]:
    """Random pieces of `rows` rows, 16 of them shuffled together: the same mixing without a thread."""
    rng = np.random.default_rng(1)
    while True:
        order = rng.permutation(len(table) // rows)
        for i in range(0, len(order), 16):
            piece = np.concatenate([table[k * rows : (k + 1) * rows] for k in order[i : i + 16]])
            shuffle = rng.permutation(len(piece))
            for start in range(0, len(piece), BATCH):
                yield len(piece[shuffle[start : start + BATCH]])


def build(args: argparse.Namespace, folder: Path) -> Database:
    """Build in a process of its own, to measure its peak memory."""
    start = time.perf_counter()
    files = made_up(folder / "clips", args.size_mb << 20, args.joints)
    print(f"made {len(files)} clips of {CLIP_ROWS} rows in {time.perf_counter() - start:.0f} s")
    seconds, peak, before = child("build", folder, str(folder / "clips"), limit_mb=1000)
    manifest = Database.open(folder / "db").manifest
    size = manifest.bytes / (1 << 20)
    print(f"build: {seconds:.1f} s, {size / seconds:.0f} MB/s, {size:.0f} MB; peak {peak:.0f} MB, ", end="")
    print(f"of which {before:.0f} MB before it began")
    print(f"bytes: {manifest.bytes / manifest.original_bytes:.1%} of the original's layout (goal: 27%)")
    return Database.open(folder / "db", args.memory_mb)


def task_build(folder: Path, clips: str) -> None:
    """The merge, as the rule calls it: seconds, peak memory, memory before, MB."""
    files = {file.stem: file for file in sorted(Path(clips).glob("*.npz"))}
    splits = dict.fromkeys(files, "train")
    before, start = status("VmRSS"), time.perf_counter()
    write_database(folder / "db", files, splits, channels=["injury"], joint_weight=0.1)
    print(time.perf_counter() - start, status("VmHWM") >> 20, before >> 20)


def task_section(folder: Path, memory_mb: str) -> None:
    """Read one section from disk with limited new address space; an allocation beyond it fails."""
    list(Database.open(folder / "small").blocks("train", 0, 0, 10, 1))  # the program itself, once through
    before = status("VmRSS")
    limit = (int(memory_mb) << 20) + 2 * STACK  # the threads' stacks; the kernel counts every byte of them
    resource.setrlimit(resource.RLIMIT_AS, (status("VmSize") + limit, resource.RLIM_INFINITY))
    db = Database.open(folder / "db", int(memory_mb))
    rows = sum(len(block.p) for block in db.blocks("train", 0, 0, 10, 1, db.block_rows(BATCH)))
    assert rows == db.section_sample_count("train", 0, 10)
    print(rows, status("VmHWM") >> 20, before >> 20)


def task_database(folder: Path, memory_mb: str) -> None:
    """Rows a second of the reader."""
    print(rate(of_database(Database.open(folder / "db", int(memory_mb)))))


def task_random_rows(folder: Path, columns: str) -> None:
    """Rows a second of single rows of a memory map."""
    print(rate(random_rows(np.memmap(folder / "expanded.bin", np.float32, "r").reshape(-1, int(columns)))))


def task_pieces(folder: Path, argument: str) -> None:
    """Rows a second of shuffled pieces of a memory map; argument: columns, rows of a piece."""
    columns, rows = map(int, argument.split())
    table = np.memmap(folder / "expanded.bin", np.float32, "r").reshape(-1, columns)
    print(rate(shuffled_pieces(table, rows)))


def reading(db: Database, folder: Path, args: argparse.Namespace) -> None:
    """Rows a second from memory, from disk and by simpler methods, and the memory under hard limits."""
    window = db.chunks_per_window("train", db.block_rows(BATCH))
    chunks = db.manifest.chunks["train"]
    print(
        f"window: {window} of {len(chunks)} chunks of {chunks[0].rows} rows, blocks of {db.block_rows(BATCH)}"
    )
    columns = db.layout.x_size + db.layout.y_size + 1
    expanded = folder / "expanded.bin"
    size = min(args.size_mb, 4 * args.memory_mb) << 20
    write_expanded(db, expanded, min(db.sample_count("train"), size // (4 * columns)))
    limit = args.memory_mb + PROGRAM_MB
    piece = (args.memory_mb << 20) // (2 * 16 * 4 * columns)
    (memory,) = child("database", folder, str(1 << 20))
    print(f"from memory                       {memory:>11,.0f} rows/s   1.00")
    for name, task, argument in (
        ("from disk", "database", str(args.memory_mb)),
        ("memmap, 16 pieces shuffled", "pieces", f"{columns} {piece}"),
        ("memmap, random rows", "random_rows", str(columns)),
    ):
        cold(folder)
        (value,) = child(task, folder, argument, limit)
        print(f"{name:<33} {value:>11,.0f} rows/s   {value / memory:.2f}")
    expanded.unlink()
    cold(folder)
    rows, peak, before = child("section", folder, str(args.memory_mb), limit)
    print(f"a section of {rows:,.0f} rows within {args.memory_mb} MB of new address space: ", end="")
    print(f"peak {peak:.0f} MB, {peak - before:.0f} MB above the program's own {before:.0f} MB")


def training(folder: Path, memory_mb: int, rounds: int) -> None:
    """The real training, from memory and from disk in turns, each turn a stretch of several windows.

    A turn begins like a section, with nothing read ahead; from disk, the page cache is dropped first. The
    order alternates from round to round. So other work on the machine affects both equally, and neither
    profits from what the other has read.
    """
    from hobble.models.pfnn import PfnnOptions
    from hobble.training import Training
    from hobble.training.batches import HostRows
    from hobble.training.checkpoint import new_state, step_for, use_threads
    from hobble.training.optimiser import Update

    use_threads(int(os.environ.get("OMP_NUM_THREADS", "2")))
    options = Training(memory_mb=memory_mb)
    disk, memory = (Database.open(folder / "db", mb) for mb in (memory_mb, 1 << 20))
    state = new_state(disk, PfnnOptions(), options)
    device = state.network.flat.device
    update = Update(step_for(state.network, options, state.half), state.adam)
    rows = disk.block_rows(options.batch)
    stretch = WINDOWS * disk.chunks_per_window("train", rows) * disk.manifest.chunks["train"][0].rows
    stretch = min(stretch, disk.section_sample_count("train", 0, 10))

    def turn(db: Database, section: int) -> tuple[float, float]:
        """Samples a second over one stretch, by the clock and by the processor time of all threads."""
        start, used, done = time.perf_counter(), time.process_time(), 0
        for batch in HostRows(db, device).batches(0, section % 10, 10, 1, options.batch):
            loss = update(*batch[:3], 1.0)
            done += len(batch.p)
            if done >= stretch:
                break
        float(loss)
        return done / (time.perf_counter() - start), done / (time.process_time() - used)

    pairs = []
    turn(memory, 0)
    for number in range(rounds):
        found = {}
        for name, db in [("disk", disk), ("memory", memory)][:: 1 - 2 * (number % 2)]:
            cold(folder / "db")
            found[name] = turn(db, number)
        pairs.append((found["memory"], found["disk"]))
    print(
        f"training on {device}, {rounds} rounds of {stretch:,} samples ({WINDOWS} windows) each way, medians:"
    )
    for k, clock in enumerate(("by the clock", "by processor time")):
        speeds = np.array(pairs)[..., k]
        from_memory, from_disk = np.median(speeds, axis=0)
        ratios = speeds[:, 1] / speeds[:, 0]
        print(f"    {clock}: {from_memory:,.0f} samples/s from memory, {from_disk:,.0f} from disk; ", end="")
        print(f"disk / memory {np.median(ratios):.3f}, {ratios.min():.3f} to {ratios.max():.3f} (goal: 0.95)")


def main() -> None:
    parser = arguments(__doc__.splitlines()[0], rounds=7)
    parser.add_argument("--joints", type=int, default=31)
    parser.add_argument("--only", choices=["reading", "training"], help="leave the other out")
    args = parser.parse_args()
    if args.task:
        globals()[f"task_{args.task}"](args.folder, args.argument)
        return
    print(processor_name())
    folder = Path(tempfile.mkdtemp(prefix="hobble-database-", dir=args.folder))
    try:
        small = made_up(folder / "one", 1, args.joints)
        splits = dict.fromkeys(small, "train")
        write_database(folder / "small", small, splits, channels=["injury"], joint_weight=0.1)
        db = build(args, folder)
        if args.only != "training":
            reading(db, folder, args)
        if args.only != "reading":
            training(folder, args.memory_mb, args.rounds)
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
