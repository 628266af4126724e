"""Reading a database back: shuffled, standardised blocks of rows, ahead of their use, in a stated memory."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import chain, cycle
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from hobble.core.errors import HobbleError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.database import order
from hobble.database.chunks import read_chunk
from hobble.database.manifest import STATISTICS, Manifest
from hobble.database.precision import STORED, widen
from hobble.database.statistics import Statistics
from hobble.rows.compose import compose, fit_columns, x_columns
from hobble.rows.layout import RowLayout

Item = TypeVar("Item")
Rooms = Iterator[Mapping[str, np.ndarray]]
BLOCK_ROWS = 4096
BLOCKS = 3  # in memory at a time: being made, waiting, in use


class Block(NamedTuple):
    """n composed rows: x (n, X) and y (n, Y), standardised float32; p (n,) phase 0 to 1, float32.

    clip (n,): index into `Database.clips`, and frame (n,) of it at 60 Hz: where a row came from.
    """

    x: Array
    y: Array
    p: Array
    clip: np.ndarray
    frame: np.ndarray


@dataclass(frozen=True)
class Window:
    """The rows of some chunks, in memory one after another.

    rows: of each chunk. first: (R,) where each row's fits begin in `fits`. The rest is what chunks hold.
    """

    rows: Sequence[int]
    first: np.ndarray
    x: Array
    y: Array
    fits: Array
    count: np.ndarray
    clip: np.ndarray
    frame: np.ndarray
    phase: Array


@dataclass(frozen=True)
class Database:
    """A database opened for reading; see `open`."""

    path: Path
    manifest: Manifest
    statistics: Statistics
    memory_mb: int
    _kept: dict[str, Window] = field(default_factory=dict, repr=False)
    _verified: set[str] = field(default_factory=set, repr=False)

    @classmethod
    def open(cls, path: str | Path, memory_mb: int = 512) -> Database:
        """Open the database folder `path`.

        memory_mb: most memory held at a time for its rows. A database that fits is loaded once; a larger
        one is read again and again, chunk by chunk. Raises InputError where there is no whole database.
        """
        path = Path(path)
        manifest = Manifest.load(path)
        statistics = Statistics(**load_npz(path / manifest.folder / STATISTICS))
        return cls(path, manifest, statistics, memory_mb)

    @property
    def layout(self) -> RowLayout:
        """Columns of the composed rows, those of its channels among them."""
        return self.manifest.layout

    @property
    def skeleton(self) -> dict[str, Any]:
        """The skeleton as plain data."""
        return dict(self.manifest.skeleton)

    @property
    def clips(self) -> tuple[str, ...]:
        """Names of the clips, of both splits; `Block.clip` is an index into them."""
        return tuple(clip["clip"] for clip in self.manifest.clips)

    def rows(self, split: str) -> int:
        """Rows (frames) of "train" or "held_out"."""
        return self.manifest.rows(split)

    def pairs(self, split: str) -> int:
        """Samples of one pass: every (frame, fit) pair, a flat row's one fit as often as others have fits."""
        return self.rows(split) * self.manifest.visits

    def section_pairs(self, split: str, section: int, sections: int) -> int:
        """Samples of one section of a pass."""
        total = self.pairs(split)
        return total * (section + 1) // sections - total * section // sections

    def blocks(
        self,
        split: str,
        pass_index: int,
        section: int,
        sections: int,
        seed: int,
        block_rows: int = BLOCK_ROWS,
    ) -> Iterator[Block]:
        """One section of one pass, in shuffled order, as blocks of `block_rows` rows (the last: the rest).

        Over the `sections` sections of a pass every (frame, fit) pair comes once (a flat row's one fit as
        often as others have fits). What comes depends on the arguments (and, where the split is larger than
        memory, on memory_mb) and never on what was read before. The next block is made in a thread
        meanwhile. Raises InputError naming the chunk where one is damaged.
        """
        if not 0 <= section < sections:
            raise HobbleError(f"there is no section {section} in a pass of {sections}")
        if self.rows(split) == 0:
            return iter(())
        spans = order.spans(self.rows(split), self.manifest.visits, section, sections)
        window = self.window(split, block_rows)
        rooms = self._rooms(split, window)
        parts = chain.from_iterable(
            self._parts(split, pass_index, seed, span, window, rooms) for span in spans
        )
        total = self.section_pairs(split, section, sections)
        return ahead(self._composed(parts, total, block_rows))

    def _parts(
        self, split: str, pass_index: int, seed: int, span: tuple[int, int, int], window: int, rooms: Rooms
    ) -> Iterator[tuple[Window, np.ndarray, np.ndarray]]:
        """Windows, the rows of them to show in order, and the fit of each: a layer from place to place.

        Windows are loaded into one of `rooms` while the one before is in use in the other, so each has to be
        done with before the next is asked for.
        """
        layer, start, stop = span
        every = range(len(self.manifest.chunks[split]))
        if window >= len(every):
            wanted: list[tuple[int, Sequence[int], int, int]] = [(0, every, start, stop)]
            windows = iter([self._whole(split)])
        else:
            wanted = list(self._wanted(split, pass_index, seed, layer, start, stop, window))
            windows = ahead(self._load(split, some, next(rooms)) for _, some, _, _ in wanted)
        for group, some, low, high in wanted:
            yield self._shown(next(windows), some, (seed, pass_index, layer), group, slice(low, high))

    def _shown(
        self, window: Window, some: Sequence[int], of: tuple[int, int, int], group: int, part: slice
    ) -> tuple[Window, np.ndarray, np.ndarray]:
        rows = order.row_order(sum(window.rows), *of, group)[part]
        ends = np.cumsum(window.rows)
        picked = [
            order.picks(window.count[end - n : end], self.manifest.visits, *of, int(chunk))
            for chunk, n, end in zip(some, window.rows, ends, strict=True)
        ]
        return window, rows, window.first[rows] + np.concatenate(picked)[rows]

    def _wanted(
        self, split: str, pass_index: int, seed: int, layer: int, start: int, stop: int, window: int
    ) -> Iterator[tuple[int, Sequence[int], int, int]]:
        """The groups of chunks with places start to stop of a layer, and the part of each that is meant."""
        rows = [chunk.rows for chunk in self.manifest.chunks[split]]
        done = 0
        for group, some in enumerate(order.groups(rows, window, seed, pass_index, layer)):
            n = sum(rows[i] for i in some)
            low, high = max(start - done, 0), min(stop - done, n)
            if low < high:
                yield group, some.tolist(), low, high
            done += n

    def block_rows(self, batch: int = 1) -> int:
        """A good length for blocks: a multiple of `batch`, about 4,096 rows, a quarter of the memory."""
        row = 4 * (self.layout.x_size + self.layout.y_size)
        most = min(BLOCK_ROWS, (self.memory_mb << 20) // (4 * BLOCKS * row))
        return batch * max(1, most // batch)

    def window(self, split: str, block_rows: int) -> int:
        """Chunks held at a time: all, where both splits fit into memory; else as many as fit in twice.

        Twice, since while one window is in use the next is read. Off the memory go the blocks being made,
        waiting and in use. Never less than one chunk.
        """
        memory = self.memory_mb << 20
        memory -= BLOCKS * block_rows * 4 * (self.layout.x_size + self.layout.y_size)
        sizes = [chunk.bytes for chunk in self.manifest.chunks[split]]
        return len(sizes) if self.manifest.bytes <= memory else max(1, memory // (2 * max(sizes)))

    def _rooms(self, split: str, window: int) -> Rooms:
        """Two rooms for windows, in turn; the memory is the same for all windows that a section reads."""
        if window >= len(self.manifest.chunks[split]):
            return iter(())
        return cycle([self._room(split, window) for _ in range(2)])

    def _whole(self, split: str) -> Window:
        if split not in self._kept:
            every = range(len(self.manifest.chunks[split]))
            self._kept[split] = self._load(split, every, self._room(split, len(every)))
        return self._kept[split]

    def _load(self, split: str, some: Sequence[int], room: Mapping[str, np.ndarray]) -> Window:
        """Chunks, one after another, read straight into `room`; checksums verified the first time."""
        chunks = [self.manifest.chunks[split][i] for i in some]
        all_rows, all_fits = sum(c.rows for c in chunks), sum(c.fits for c in chunks)
        tables = {name: table[: all_fits if name == "fits" else all_rows] for name, table in room.items()}
        row = fit = 0
        for chunk in chunks:
            rows, fits = slice(row, row + chunk.rows), slice(fit, fit + chunk.fits)
            parts = {name: table[fits if name == "fits" else rows] for name, table in tables.items()}
            folder = self.path / self.manifest.folder
            read_chunk(folder, chunk, parts, verify=chunk.file not in self._verified)
            self._verified.add(chunk.file)
            row, fit = rows.stop, fits.stop
        first = np.cumsum(tables["count"], dtype=np.int64) - tables["count"]
        return Window([c.rows for c in chunks], first, **tables)

    def _room(self, split: str, window: int) -> dict[str, np.ndarray]:
        """Empty arrays for what any `window` chunks hold, in their order."""
        chunks = self.manifest.chunks[split]
        rows = sum(sorted(chunk.rows for chunk in chunks)[-window:])
        fits = sum(sorted(chunk.fits for chunk in chunks)[-window:])
        floats = STORED[self.manifest.dtype]
        return {
            "x": np.empty((rows, x_columns(self.layout)), floats),
            "y": np.empty((rows, self.layout.y_size), floats),
            "fits": np.empty((fits, fit_columns(self.layout)), floats),
            "count": np.empty(rows, np.int32),
            "clip": np.empty(rows, np.int32),
            "frame": np.empty(rows, np.int32),
            "phase": np.empty(rows, np.float32),
        }

    def _composed(
        self, parts: Iterator[tuple[Window, np.ndarray, np.ndarray]], total: int, block_rows: int
    ) -> Iterator[Block]:
        """Blocks of `block_rows` rows out of parts of any length."""
        block, filled = self._empty(min(block_rows, total)), 0
        for window, rows, fit in parts:
            while len(rows):
                n = min(len(rows), len(block.p) - filled)
                here, some = slice(filled, filled + n), rows[:n]
                self._compose(window, some, fit[:n], block.x[here], block.y[here])
                block.p[here] = window.phase[some]
                block.clip[here], block.frame[here] = window.clip[some], window.frame[some]
                rows, fit, filled = rows[n:], fit[n:], filled + n
                if filled == len(block.p):
                    yield block
                    total -= filled
                    block, filled = self._empty(min(block_rows, total)), 0

    def _compose(self, window: Window, rows: np.ndarray, fit: np.ndarray, x: Array, y: Array) -> None:
        """Fill x and y. Plain gathers: 2 million rows a second and core with 31 joints."""
        frames, ground = widen(window.x[rows]), widen(window.fits[fit])
        if window.y.dtype == y.dtype:
            np.take(window.y, rows, axis=0, out=y, mode="clip")  # any other mode copies once more
        else:
            y[...] = widen(window.y[rows])
        lift = ground[:, -1:].astype(np.float32)
        some = lift if lift.any() else None
        compose(self.layout, frames, ground[:, :-1], some, x, y, self.statistics.x_std, self.statistics.y_std)

    def _empty(self, rows: int) -> Block:
        x = np.empty((rows, self.layout.x_size), np.float32)
        y = np.empty((rows, self.layout.y_size), np.float32)
        return Block(x, y, np.empty(rows, np.float32), np.empty(rows, np.int32), np.empty(rows, np.int32))


def ahead(items: Iterator[Item]) -> Iterator[Item]:
    """The same items; while one is in use, the next is being made in a thread."""
    nothing = object()
    with ThreadPoolExecutor(1, "ahead") as pool:
        future = pool.submit(next, items, nothing)
        while (item := future.result()) is not nothing:
            future = pool.submit(next, items, nothing)
            yield item  # type: ignore[misc]
