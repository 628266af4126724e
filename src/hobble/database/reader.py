"""Reading a database back: shuffled, standardised blocks of rows, ahead of their use, in a stated memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from hobble.core.errors import HobbleError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.database import order
from hobble.database.chunks import Chunk, read_chunk
from hobble.database.compose import compose
from hobble.database.layout import RowLayout
from hobble.database.manifest import STATISTICS, Manifest
from hobble.database.statistics import Statistics

Item = TypeVar("Item")
BLOCK_ROWS = 4096
LEAST_WINDOW = 2


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
    """The rows of some chunks, in memory one after another. first: (R,) where each row's fits begin."""

    chunks: Sequence[int]
    rows: Sequence[int]
    frames: Array
    fits: Array
    first: np.ndarray
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

        memory_mb: most memory held at a time for its rows. A split that fits is loaded once; a larger one
        is read again and again, chunk by chunk. Raises InputError where there is no whole database.
        """
        path = Path(path)
        manifest = Manifest.load(path)
        statistics = Statistics(**load_npz(path / manifest.folder / STATISTICS))
        return cls(path, manifest, statistics, memory_mb)

    @property
    def layout(self) -> RowLayout:
        """Columns of the composed rows; `links` is 0 where severities are not inputs."""
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
        visits = order.spans(self.rows(split), self.manifest.visits, section, sections)
        parts = (part for span in visits for part in self._parts(split, pass_index, seed, span))
        total = self.section_pairs(split, section, sections)
        return ahead(self._composed(parts, total, block_rows))

    def _parts(
        self, split: str, pass_index: int, seed: int, span: tuple[int, int, int]
    ) -> Iterator[tuple[Window, np.ndarray, np.ndarray]]:
        """Windows, the rows of them to show in order, and the fit of each: a layer from place to place."""
        layer, start, stop = span
        chunks = self.manifest.chunks[split]
        if self._fits_memory(split):
            wanted = [(0, range(len(chunks)), start, stop)]
            load: Callable[[Sequence[int]], Window] = lambda _: self._whole(split)  # noqa: E731
        else:
            wanted = list(self._wanted(split, pass_index, seed, layer, start, stop))
            load = lambda some: self._load(split, some)  # noqa: E731
        windows = ahead(load(some) for _, some, _, _ in wanted)
        for window, (group, some, low, high) in zip(windows, wanted, strict=True):
            rows = order.row_order(sum(window.rows), seed, pass_index, layer, group)[low:high]
            args = (self.manifest.visits, seed, pass_index, layer)
            ends = np.cumsum(window.rows)
            picked = [
                order.picks(window.count[end - n : end], *args, int(chunk))
                for chunk, n, end in zip(some, window.rows, ends, strict=True)
            ]
            yield window, rows, window.first[rows] + np.concatenate(picked)[rows]

    def _wanted(
        self, split: str, pass_index: int, seed: int, layer: int, start: int, stop: int
    ) -> Iterator[tuple[int, Sequence[int], int, int]]:
        """The groups of chunks with places start to stop of a layer, and the part of each that is meant."""
        rows = [chunk.rows for chunk in self.manifest.chunks[split]]
        done = 0
        for group, some in enumerate(order.groups(rows, self._window(split), seed, pass_index, layer)):
            n = sum(rows[i] for i in some)
            low, high = max(start - done, 0), min(stop - done, n)
            if low < high:
                yield group, some.tolist(), low, high
            done += n

    def _fits_memory(self, split: str) -> bool:
        return sum(chunk.bytes for chunk in self.manifest.chunks[split]) <= self._budget()

    def _budget(self) -> int:
        """Bytes for rows: what is stated less the three blocks that are being made, waiting and in use."""
        block = BLOCK_ROWS * 4 * (self.layout.x_size + self.layout.y_size)
        return max((self.memory_mb << 20) - 3 * block, (self.memory_mb << 20) // 4)

    def _window(self, split: str) -> int:
        """Chunks mixed at a time: the one in use and the one being read both have to fit."""
        largest = max(chunk.bytes for chunk in self.manifest.chunks[split])
        return max(LEAST_WINDOW, self._budget() // (2 * largest))

    def _whole(self, split: str) -> Window:
        if split not in self._kept:
            self._kept[split] = self._load(split, range(len(self.manifest.chunks[split])))
        return self._kept[split]

    def _load(self, split: str, some: Sequence[int]) -> Window:
        """Chunks, one after another in one table; each is copied there as it is read."""
        chunks = [self.manifest.chunks[split][i] for i in some]
        tables: dict[str, np.ndarray] = {}
        row = fit = 0
        for chunk in chunks:
            for name, array in self._read(chunk).items():
                if name not in tables:
                    total = sum(c.fits if name == "fits" else c.rows for c in chunks)
                    tables[name] = np.empty((total, *array.shape[1:]), array.dtype)
                at = fit if name == "fits" else row
                tables[name][at : at + len(array)] = array
            row, fit = row + chunk.rows, fit + chunk.fits
        count = tables["count"].astype(np.int64)
        return Window(some, [c.rows for c in chunks], first=np.cumsum(count) - count, **tables)

    def _read(self, chunk: Chunk) -> dict[str, np.ndarray]:
        """A chunk, its checksum verified the first time."""
        arrays = read_chunk(self.path / self.manifest.folder, chunk, chunk.file not in self._verified)
        self._verified.add(chunk.file)
        return arrays

    def _composed(
        self, parts: Iterator[tuple[Window, np.ndarray, np.ndarray]], total: int, block_rows: int
    ) -> Iterator[Block]:
        """Blocks of `block_rows` rows out of parts of any length."""
        block, filled = self._empty(min(block_rows, total)), 0
        for window, rows, fit in parts:
            while len(rows):
                n = min(len(rows), len(block.p) - filled)
                here, some = slice(filled, filled + n), rows[:n]
                compose(
                    self.layout,
                    self.statistics,
                    window.frames,
                    window.fits,
                    some,
                    fit[:n],
                    block.x[here],
                    block.y[here],
                )
                block.p[here] = window.phase[some]
                block.clip[here], block.frame[here] = window.clip[some], window.frame[some]
                rows, fit, filled = rows[n:], fit[n:], filled + n
                if filled == len(block.p):
                    yield block
                    total -= filled
                    block, filled = self._empty(min(block_rows, total)), 0

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
