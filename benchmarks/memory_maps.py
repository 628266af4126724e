"""Compares the database's reader with a reader of the same rows from memory maps, as ratios in one run.

    python benchmarks/memory_maps.py [--size-mb 1280] [--memory-mb 128] [--rounds 5] [--folder DIR]

Both give the same blocks, bit for bit. The tables of the memory maps are .npy files of all chunks one after
another. They are read in windows of as many chunks as the reader's, and in one window, so that rows come from
anywhere in the file. Everything runs in turns. From disk, the page cache is dropped first, and each reader is
in a memory cgroup of `memory-mb` plus the program's own memory, if one can be made.
"""

from __future__ import annotations

import inspect
import shutil
import tempfile
import time
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import numpy as np
from database import BATCH, PROGRAM_MB, made_up
from database import SECONDS as READING_SECONDS
from own_process import arguments, child, cold, status

from hobble.core.processors import processor_name
from hobble.database import chunk_window, chunks, order, reader
from hobble.database.chunk_window import empty_buffers
from hobble.database.merge import write_database
from hobble.database.reader import Block, Database, read_ahead

TABLES = ("x", "y", "fits", "count", "clip", "frame", "phase")
SECTIONS = 10


def write_tables(db: Database, folder: Path) -> None:
    """The arrays of all training chunks, one after another, as .npy files."""
    folder.mkdir()
    all_chunks = db.manifest.chunks["train"]
    kinds = empty_buffers(db.manifest, "train", 1)
    for name in TABLES:
        rows = sum(c.fits if name == "fits" else c.rows for c in all_chunks)
        shape = (rows, *kinds[name].shape[1:])
        table = np.lib.format.open_memmap(folder / f"{name}.npy", "w+", kinds[name].dtype, shape)
        done = 0
        for i in range(len(all_chunks)):
            part = getattr(db.load("train", [i], kinds), name)
            table[done : done + len(part)] = part
            done += len(part)
        table.flush()


class Mapped:
    """A reader of memory maps. It composes rows as the database does.

    chunk_rows: rows of each chunk, the pieces that are visited in a random order.
    """

    def __init__(self, db: Database, folder: Path) -> None:
        self.db = db
        for name in TABLES:
            setattr(self, name, np.load(folder / f"{name}.npy", mmap_mode="r"))
        self.first = order.first_fits(self.count)
        self.chunk_rows = [c.rows for c in db.manifest.chunks["train"]]
        self.shards = db.manifest.shard_of_chunk("train")
        self.starts = np.cumsum(self.chunk_rows) - self.chunk_rows

    def blocks(self, section: int, seed: int, block_rows: int, window: int) -> Iterator[Block]:
        """A section of the first pass, like `Database.blocks` with windows of this many chunks."""
        visits, rows = self.db.manifest.visits, self.db.row_count("train")
        parts = chain.from_iterable(
            self.parts((seed, 0, layer), start, stop, window)
            for layer, start, stop in order.layer_parts(rows, visits, section, SECTIONS)
        )
        return read_ahead(
            self.db._compose_blocks(
                parts, self.db.section_sample_count("train", section, SECTIONS), block_rows
            )
        )

    def parts(self, of: tuple[int, int, int], start: int, stop: int, window: int) -> Iterator[tuple]:
        """Rows and fits of the places start to stop of a layer, as indices into the whole tables."""
        every = range(len(self.chunk_rows))
        some = [np.array(every)] if window >= len(every) else order.chunk_groups(self.shards, window, *of)
        done = 0
        for group, members in enumerate(some):
            own = np.concatenate([np.arange(n) + s for n, s in self.pieces(members)])
            low, high = max(start - done, 0), min(stop - done, len(own))
            if low < high:
                yield self, *self.shown(members, own, (*of, group), slice(low, high))
            done += len(own)

    def shown(
        self, members: np.ndarray, own: np.ndarray, place: tuple[int, int, int, int], part: slice
    ) -> tuple[np.ndarray, np.ndarray]:
        """Rows and fits of a group of chunks. own: the group's rows in the tables."""
        rows, count = [n for n, _ in self.pieces(members)], np.asarray(self.count[own])
        here, fit = order.rows_and_fits(
            members, rows, count, np.zeros(len(own), np.int64), self.db.manifest.visits, place, part
        )
        return own[here], self.first[own[here]] + fit

    def pieces(self, members: np.ndarray) -> list[tuple[int, int]]:
        """Rows and first row of each of these chunks."""
        return [(self.chunk_rows[i], int(self.starts[i])) for i in members]


def task_same(folder: Path, memory_mb: str) -> None:
    """Assert that both give the same blocks, in a process that does not keep the maps."""
    db = Database.open(folder / "db", int(memory_mb))
    mapped = Mapped(db, folder / "tables")
    rows, every = db.block_rows(BATCH), len(mapped.chunk_rows)
    for width in (db.chunks_per_window("train", rows), every):
        pairs = zip(
            db.blocks("train", 0, 3, SECTIONS, 1, rows, window=width),
            mapped.blocks(3, 1, rows, width),
            strict=True,
        )
        for ours, theirs in pairs:
            for a, b in zip(ours, theirs, strict=True):
                assert np.array_equal(a, b)


def rows_of(folder: Path, kind: str, memory_mb: int) -> Iterator[int]:
    """Rows of one block after another. kind: reader, windows or anywhere."""
    db = Database.open(folder / "db", memory_mb)
    rows = db.block_rows(BATCH)
    mapped = None if kind == "reader" else Mapped(db, folder / "tables")
    width = len(db.manifest.chunks["train"]) if kind == "anywhere" else db.chunks_per_window("train", rows)
    for section in range(1_000_000):
        number = section % SECTIONS
        if mapped is None:
            blocks = db.blocks("train", 0, number, SECTIONS, 1, rows)
        else:
            blocks = mapped.blocks(number, 1, rows, width)
        for block in blocks:
            yield len(block.p)


def task_maps(folder: Path, argument: str) -> None:
    """Rows a second by the clock and by processor time, and the highest memory, without and with files."""
    kind, memory_mb, warm = argument.split()
    batches = rows_of(folder, kind, int(memory_mb))
    if warm == "1":  # every page once, so that the page cache has it
        for file in (folder / ("db" if kind == "reader" else "tables")).rglob("*"):
            if file.is_file():
                file.read_bytes()
    next(batches)
    start, used, rows, own = time.perf_counter(), time.process_time(), 0, 0
    while time.perf_counter() - start < READING_SECONDS:
        rows += next(batches)
        own = max(own, status("RssAnon"))
    clock, processor = time.perf_counter() - start, time.process_time() - used
    print(rows / clock, rows / processor, own >> 20, status("VmHWM") >> 20)


def lines(*of: object) -> int:
    """Lines of code of modules or functions, without blank lines."""
    return sum(bool(line.strip()) for one in of for line in inspect.getsource(one).splitlines())


def measure(folder: Path, memory_mb: int, rounds: int) -> None:
    """All readers in turns, from memory and from disk."""
    for where, memory, warm in (("memory", 1 << 14, 1), ("disk", memory_mb, 0)):
        found: dict[str, list[list[float]]] = {"reader": [], "windows": [], "anywhere": []}
        for number in range(rounds):
            for kind in list(found)[:: 1 - 2 * (number % 2)]:
                cold(folder)
                limit = None if warm else memory_mb + PROGRAM_MB
                found[kind].append(child("maps", folder, f"{kind} {memory} {warm}", limit))
        base = np.median(found["reader"], axis=0)
        for kind, runs in found.items():
            clock, processor, own, peak = np.median(runs, axis=0)
            print(
                f"from {where}, {kind:<9} {clock:>11,.0f} rows/s ({clock / base[0]:.2f} of the reader), "
                f"{processor:>11,.0f} by processor time ({processor / base[1]:.2f}); "
                f"own memory {own:.0f} MB, with pages of files {peak:.0f} MB"
            )


def main() -> None:
    args = arguments(__doc__.splitlines()[0], rounds=5).parse_args()
    if args.task:
        globals()[f"task_{args.task}"](args.folder, args.argument)
        return
    print(processor_name())
    folder = Path(tempfile.mkdtemp(prefix="hobble-maps-", dir=args.folder))
    try:
        files = made_up(folder / "clips", args.size_mb << 20, 31)
        write_database(
            folder / "db", files, dict.fromkeys(files, "train"), channels=["injury"], joint_weight=0.1
        )
        shutil.rmtree(folder / "clips")
        db = Database.open(folder / "db", args.memory_mb)
        write_tables(db, folder / "tables")
        child("same", folder, str(args.memory_mb))
        print(f"both give the same blocks; {db.manifest.bytes >> 20} MB of rows")
        ours = lines(reader, chunk_window, chunks)
        without = lines(
            chunk_window, chunks, Database._parts, Database._wanted, Database.load, Database._whole
        )
        without += lines(Database._buffers)
        print(f"lines of reader, window and chunks: {ours}; with memory maps about ", end="")
        print(f"{ours - without + lines(Mapped)}, without checksums and the memory limit")
        measure(folder, args.memory_mb, args.rounds)
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
