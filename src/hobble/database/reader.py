"""Reads a database as shuffled, standardised blocks of rows, ahead of their use and within a memory limit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import chain, cycle
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from hobble.core.errors import HobbleError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.database import order
from hobble.database.chunk_window import Buffers, ChunkWindow, empty_buffers, load_chunks
from hobble.database.manifest import STATISTICS, Manifest
from hobble.database.precision import widen
from hobble.database.scale import Shards
from hobble.database.sharing import SampleRange
from hobble.database.statistics import Statistics
from hobble.rows.compose import compose
from hobble.rows.layout import RowLayout

Item = TypeVar("Item")
# A window, (n,) indices of rows in it, and (n,) the index of each row's fit.
Part = tuple[ChunkWindow, np.ndarray, np.ndarray]
BLOCK_ROWS = 4096  # rows of a block, unless the caller asks for another number
BLOCKS = 3  # blocks in memory at a time: one being made, one waiting, one in use


class Block(NamedTuple):
    """n rows as a network gets them: x (n, X) and y (n, Y), standardised float32; p (n,) phase 0 to 1.

    A row is composed of a frame, the channels and a terrain fit. clip: (n,) index into `Database.clips`;
    frame: (n,) frame of the clip at 60 Hz.
    """

    x: Array
    y: Array
    p: Array
    clip: np.ndarray
    frame: np.ndarray


class RawRows(NamedTuple):
    """n rows without terrain, standardised float32: x (n, X without terrain), y (n, Y), p (n,) phase.

    fits: (m, columns) all terrain fits of these rows: heights, then the lift in cm (by how much the mean
    height of this fit is above the mean of all fits of the row). first: (n,) index of each row's first fit.
    """

    x: Array
    y: Array
    p: Array
    fits: Array
    first: np.ndarray


@dataclass(frozen=True)
class Database:
    """A database opened for reading with the method `open`.

    path: its folder. memory_mb: MiB of memory for rows. phase_weight: by how much the standardised change of
    phase is multiplied.
    """

    path: Path
    manifest: Manifest
    statistics: Statistics
    memory_mb: int
    _shards: Shards = field(repr=False)
    _loaded: dict[str, ChunkWindow] = field(default_factory=dict, repr=False)
    _verified: set[str] = field(default_factory=set, repr=False)
    phase_weight: float = 1.0

    @classmethod
    def open(cls, path: str | Path, memory_mb: int = 512) -> Database:
        """Open the database folder `path`.

        memory_mb: MiB of memory for rows, for each section that is being read. A database that fits is loaded
        once; a larger one is read again and again, chunk by chunk. Raises InputError if the database is not
        complete.
        """
        path = Path(path)
        manifest = Manifest.load(path)
        statistics = Statistics(**load_npz(path / manifest.folder / STATISTICS))
        return cls(path, manifest, statistics, memory_mb, Shards(path, manifest, statistics))

    def with_phase_weight(self, weight: float) -> Database:
        """The same rows, with the standardised change of phase multiplied by `weight`.

        Its squared error then counts `weight`^2 times in a mean over the standardised columns.
        """
        if weight == 1.0:
            return self
        y_std = self.statistics.y_std.copy()
        y_std[self.layout.y_phase_change] /= weight
        statistics = replace(self.statistics, y_std=y_std)
        shards = Shards(self.path, self.manifest, statistics)
        return Database(
            self.path,
            self.manifest,
            statistics,
            self.memory_mb,
            shards,
            phase_weight=self.phase_weight * weight,
        )

    @property
    def layout(self) -> RowLayout:
        """Columns of the composed rows, including those of the channels."""
        return self.manifest.layout

    @property
    def skeleton(self) -> dict[str, Any]:
        """The skeleton as plain data."""
        return dict(self.manifest.skeleton)

    @property
    def clips(self) -> tuple[str, ...]:
        """Names of the clips, of both splits; `Block.clip` is an index into them."""
        return tuple(clip["clip"] for clip in self.manifest.clips)

    @property
    def sources(self) -> dict[str, str]:
        """Hurt version -> the healthy clip it is made from."""
        return {clip["clip"]: clip["source"] for clip in self.manifest.clips if "source" in clip}

    def rows(self, split: str) -> int:
        """Number of rows (frames) of "train" or "held_out"."""
        return self.manifest.rows(split)

    def samples(self, split: str) -> int:
        """Number of samples of a pass: (frame, fit) pairs. A flat row's one fit counts `visits` times."""
        return self.rows(split) * self.manifest.visits

    def section_samples(self, split: str, section: int, sections: int) -> int:
        """Number of samples of one section of a pass."""
        total = self.samples(split)
        return total * (section + 1) // sections - total * section // sections

    def blocks(
        self,
        split: str,
        pass_index: int,
        section: int,
        sections: int,
        seed: int,
        block_rows: int = BLOCK_ROWS,
        stretch: SampleRange | None = None,
        window: int | None = None,
    ) -> Iterator[Block]:
        """One section of one pass, shuffled, as blocks of `block_rows` rows; the last may be shorter.

        Over the `sections` sections of a pass, every (frame, fit) pair comes once (the one fit of a flat row:
        `visits` times). The blocks depend only on the arguments (and on memory_mb, if the split does not fit
        in memory), not on what was read before. The next block is made in a thread.

        section: number of the section, from 0. stretch: the part of the section to read; None: all. window:
        number of chunks in memory at a time; None: as the method `window` says. Raises InputError, which
        names the file, if a chunk is damaged.
        """
        if not 0 <= section < sections:
            raise HobbleError(f"there is no section {section} in a pass of {sections}")
        if self.rows(split) == 0:
            return iter(())
        total = self.section_samples(split, section, sections)
        stretch = stretch or SampleRange(0, total, total, 0, total)
        cut = stretch.start, stretch.stop
        spans = order.layer_parts(self.rows(split), self.manifest.visits, section, sections, cut)
        window = window or self.window(split, block_rows)
        buffers = self._buffers(split, window)
        parts = chain.from_iterable(
            self._parts(split, (seed, pass_index, layer), start, stop, window, buffers)
            for layer, start, stop in spans
        )
        return read_ahead(self._composed(_for_this_process(parts, stretch), stretch.rows, block_rows))

    def each_row(self, split: str) -> Iterator[RawRows]:
        """Every row of a split once, with all its fits, in the order of the chunks."""
        chunks = len(self.manifest.chunks[split])
        window = self.window(split, BLOCK_ROWS)
        if window < chunks:
            numbers, buffers = range(chunks), self._buffers(split, window)
            groups = (numbers[start : start + window] for start in range(0, chunks, window))
            windows = read_ahead(self.load(split, some, next(buffers)) for some in groups)
        else:
            windows = iter([self._whole(split)] if chunks else [])
        for read in windows:
            for start in range(0, len(read.count), BLOCK_ROWS):
                part = slice(start, start + BLOCK_ROWS)
                first, count = read.first[part], read.count[part]
                fits = widen(read.fits[first[0] : first[-1] + count[-1]]).astype(np.float32)
                x, y = (widen(table[part]).astype(np.float32) for table in (read.x, read.y))
                yield RawRows(x, y, read.phase[part], fits, first - first[0])

    def _parts(
        self,
        split: str,
        of: tuple[int, int, int],
        start: int,
        stop: int,
        window: int,
        buffers: Iterator[Buffers],
    ) -> Iterator[Part]:
        """The rows at places `start` to `stop` - 1 of a layer.

        of: seed, pass and layer. window: number of chunks in memory at a time. buffers: two sets of buffers
        in turn. The next window is loaded into one set while the present one, in the other set, is in use. So
        do not use a window after requesting the next part.
        """
        all_chunks = range(len(self.manifest.chunks[split]))
        if window >= len(all_chunks):
            wanted: list[tuple[int, Sequence[int], int, int]] = [(0, all_chunks, start, stop)]
            windows = iter([self._whole(split)])
        else:
            wanted = list(self._wanted(split, of, start, stop, window))
            windows = read_ahead(self.load(split, some, next(buffers)) for _, some, _, _ in wanted)
        for group, _, low, high in wanted:
            w, part, visits = next(windows), slice(low, high), self.manifest.visits
            yield w, *order.rows_and_fits(w.chunks, w.rows, w.count, w.first, visits, (*of, group), part)

    def _wanted(
        self, split: str, of: tuple[int, int, int], start: int, stop: int, window: int
    ) -> Iterator[tuple[int, Sequence[int], int, int]]:
        """The groups of chunks with the rows at places `start` to `stop` - 1 of a layer.

        Yields (number of the group, chunks, first place in the group, last place + 1).
        """
        rows = [chunk.rows for chunk in self.manifest.chunks[split]]
        done = 0
        for group, some in enumerate(order.chunk_groups(self._shards.of_chunks[split], window, *of)):
            n = sum(rows[i] for i in some)
            low, high = max(start - done, 0), min(stop - done, n)
            if low < high:
                yield group, some.tolist(), low, high
            done += n

    def block_rows(self, batch: int = 1) -> int:
        """A good number of rows for a block: a multiple of `batch`, about 4,096.

        It is lower if the blocks would otherwise take more than a quarter of the memory.
        """
        row = 4 * (self.layout.x_size + self.layout.y_size)
        limit = min(BLOCK_ROWS, (self.memory_mb << 20) // (4 * BLOCKS * row))
        return batch * max(1, limit // batch)

    def window(self, split: str, block_rows: int) -> int:
        """How many chunks are in memory at a time: all if both splits fit, else as many as fit twice.

        Twice, because the next chunks are read while the present ones are in use. At least one. Memory
        for the blocks is subtracted first.
        """
        memory = self.memory_mb << 20
        memory -= BLOCKS * block_rows * 4 * (self.layout.x_size + self.layout.y_size)
        sizes = [chunk.bytes for chunk in self.manifest.chunks[split]]
        return len(sizes) if self.manifest.bytes <= memory else max(1, memory // (2 * max(sizes)))

    def _buffers(self, split: str, window: int) -> Iterator[Buffers]:
        """Two sets of buffers for windows, in turn. All windows of a section reuse them."""
        if window >= len(self.manifest.chunks[split]):
            return iter(())
        return cycle([empty_buffers(self.manifest, split, window) for _ in range(2)])

    def _whole(self, split: str) -> ChunkWindow:
        """All chunks of a split, which are read once."""
        if split not in self._loaded:
            numbers = range(len(self.manifest.chunks[split]))
            self._loaded[split] = self.load(split, numbers, empty_buffers(self.manifest, split, len(numbers)))
        return self._loaded[split]

    def load(self, split: str, numbers: Sequence[int], into: Buffers) -> ChunkWindow:
        """Read the chunks with these numbers of a split into buffers from `empty_buffers`."""
        folder = self.path / self.manifest.folder
        return load_chunks(folder, self.manifest, split, numbers, into, self._shards, self._verified)

    def _composed(self, parts: Iterator[Part], total: int, block_rows: int) -> Iterator[Block]:
        """Blocks of `block_rows` rows from parts of any length."""
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

    def _compose(self, window: ChunkWindow, rows: np.ndarray, fit: np.ndarray, x: Array, y: Array) -> None:
        """Fill x and y with `rows`, each with its `fit`; 2 million rows (31 joints) a second on one core."""
        frames, ground = widen(window.x[rows]), widen(window.fits[fit])
        if window.y.dtype == y.dtype:
            np.take(window.y, rows, axis=0, out=y, mode="clip")  # the default mode makes another copy
        else:
            y[...] = widen(window.y[rows])
        lift = ground[:, -1:].astype(np.float32)
        lift_or_none = lift if lift.any() else None
        stds = self.statistics.x_std, self.statistics.y_std
        compose(self.layout, frames, ground[:, :-1], lift_or_none, x, y, *stds)

    def _empty(self, rows: int) -> Block:
        x = np.empty((rows, self.layout.x_size), np.float32)
        y = np.empty((rows, self.layout.y_size), np.float32)
        return Block(x, y, np.empty(rows, np.float32), np.empty(rows, np.int32), np.empty(rows, np.int32))


def _for_this_process(parts: Iterator[Part], stretch: SampleRange) -> Iterator[Part]:
    """Only the samples of a stretch that this process reads."""
    done = 0
    for window, rows, fits in parts:
        some = stretch.kept(done, len(rows))
        done += len(rows)
        yield window, rows[some], fits[some]


def read_ahead(items: Iterator[Item]) -> Iterator[Item]:
    """Yield the items. A thread makes the next item while one is in use."""
    nothing = object()
    with ThreadPoolExecutor(1, "ahead") as pool:
        future = pool.submit(next, items, nothing)
        while (item := future.result()) is not nothing:
            future = pool.submit(next, items, nothing)
            yield item  # type: ignore[misc]
