"""Reads a database as shuffled, standardised blocks of rows. It reads ahead, within a memory limit.

A row belongs to a frame of a clip. It has one or more terrain fits: ground heights that suit the motion. A
chunk is a file with some of the rows. A pass over a split uses each row `visits` times, with its fits in
turn. So it consists of `visits` layers, and a layer has each row once (`hobble.database.order`). Callers read
a pass in `sections`, which are parts of nearly equal length. A `ChunkWindow` holds the chunks that are in
memory together. A parameter `window` is the number of these chunks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from itertools import cycle
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.database import order
from hobble.database.chunks import STATISTICS, STORED, Manifest, read_chunk, to_stored_type
from hobble.database.statistics import Statistics, read_statistics
from hobble.rows.layout import (
    RowLayout,
    blocks_without_terrain,
    column_count_without_terrain,
    compose,
    fit_column_count,
)

Buffers = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class ChunkWindow:
    """The rows of some chunks of a split ("train" or "held_out"), chunk after chunk.

    chunks: the numbers of the chunks in the split. rows: number of rows of each chunk. The arrays hold R rows
    with together S terrain fits (patches of ground that suit the motion), in the types of the chunk files.
    x: (R, columns of X without terrain). y: (R, Y). count: (R,) number of fits of each row. fits: (S,
    columns) the fits, row after row. first_fit: (R,) index of each row's first fit in `fits`. clip: (R,)
    number of each row's clip in the database. frame: (R,) frame in this clip. phase: (R,).
    """

    chunks: Sequence[int]
    rows: Sequence[int]
    first_fit: np.ndarray
    x: Array
    y: Array
    fits: Array
    count: np.ndarray
    clip: np.ndarray
    frame: np.ndarray
    phase: Array


def empty_buffers(manifest: Manifest, split: str, count: int) -> dict[str, np.ndarray]:
    """Empty arrays, by name, that are large enough for any `count` chunks of a split.

    The names and their order are those of the arrays in a chunk file.
    """
    chunks = manifest.chunks[split]
    # the `count` largest chunks together
    rows = sum(sorted(chunk.rows for chunk in chunks)[-count:])
    fits = sum(sorted(chunk.fits for chunk in chunks)[-count:])
    floats = STORED[manifest.dtype]
    return {
        "x": np.empty((rows, column_count_without_terrain(manifest.layout)), floats),
        "y": np.empty((rows, manifest.layout.y_size), floats),
        "fits": np.empty((fits, fit_column_count(manifest.layout)), floats),
        "count": np.empty(rows, np.int32),
        "clip": np.empty(rows, np.int32),
        "frame": np.empty(rows, np.int32),
        "phase": np.empty(rows, np.float32),
    }


Item = TypeVar("Item")
# n rows to compose: a window, (n,) indices of rows in it, and (n,) for each row the index of one of its fits.
PickedRows = tuple[ChunkWindow, np.ndarray, np.ndarray]
BLOCK_ROWS = 4096  # rows of a block, unless the caller asks for another number
BLOCKS = 3  # blocks in memory at a time: one being made, one waiting, one in use


class Block(NamedTuple):
    """n rows as a network gets them. Each is composed of a frame's columns and one of its terrain fits.

    x: (n, X) and y: (n, Y), standardised float32. p: (n,) phase, from 0 to 1. clip: (n,) index into
    `Database.clips`. frame: (n,) frame of the clip at 60 Hz.
    """

    x: Array
    y: Array
    p: Array
    clip: np.ndarray
    frame: np.ndarray


class UncomposedRows(NamedTuple):
    """n standardised rows, float32, with all their terrain fits. Rows and fits are not yet composed.

    x: (n, X without terrain). y: (n, Y). p: (n,) phase. clip: (n,) index into `Database.clips`. fits: (m,
    columns) the fits, row after row: ground heights, then the lift in cm. The lift says how far the fit's
    mean height is above the average of these means over all fits of the row. first_fit: (n,) index of each
    row's first fit in `fits`.
    """

    x: Array
    y: Array
    p: Array
    clip: np.ndarray
    fits: Array
    first_fit: np.ndarray


@dataclass(frozen=True)
class Database:
    """A database that the method `open` opened for reading.

    path: its folder. memory_mb: MiB of memory for rows. phase_weight: factor by which the standardised change
    of phase, a column of Y, is multiplied.
    """

    path: Path
    manifest: Manifest
    statistics: Statistics
    memory_mb: int
    _loaded: dict[str, ChunkWindow] = field(default_factory=dict, repr=False)
    _verified: set[str] = field(default_factory=set, repr=False)
    phase_weight: float = 1.0
    # Table of rows, columns in it, and the factor of what is stored there.
    _factors: tuple[tuple[str, slice, float], ...] = ()

    @classmethod
    def open(
        cls,
        path: str | Path,
        memory_mb: int = 512,
        phase_weight: float = 1.0,
        scales: Mapping[str, float] | None = None,
    ) -> Database:
        """Open the database folder `path`.

        memory_mb: MiB of memory for rows, for each section that is being read. A database that fits is read
        once. The chunks of a larger one are read again for every layer. phase_weight: factor of the
        standardised change of phase. Its squared error then counts `phase_weight`^2 times in a mean over the
        columns of Y. scales: channel -> number by which its standardised columns of X are divided. Raises
        InputError if the database is not complete or has no such channel.
        """
        path = Path(path)
        manifest = Manifest.load(path)
        statistics = read_statistics(path / manifest.folder / STATISTICS, manifest.layout)
        column = manifest.layout.y_phase_change
        stored = float(statistics.y_std[column][0])
        statistics.y_std[column] /= phase_weight
        factors = [("y", column, stored / float(statistics.y_std[column][0]))]
        for name, scale in (scales or {}).items():
            if name not in dict(manifest.layout.channels):
                fix = "Leave it out of `scales`, or add it to the configuration's `channels`."
                raise InputError(path, f"the channel {name} is not in this database", fix=fix)
            statistics.x_std[manifest.layout.x_channel(name)] *= scale
            factors.append(("x", blocks_without_terrain(manifest.layout)[name], 1 / scale))
        changed = tuple(each for each in factors if each[-1] != 1.0)
        return cls(path, manifest, statistics, memory_mb, phase_weight=phase_weight, _factors=changed)

    @property
    def layout(self) -> RowLayout:
        """Columns of the composed rows, including those of the channels."""
        return self.manifest.layout

    @property
    def skeleton(self) -> dict[str, Any]:
        """The skeleton as plain data, for `Skeleton.from_dict`."""
        return dict(self.manifest.skeleton)

    @property
    def clips(self) -> tuple[str, ...]:
        """Names of the clips of both splits. `Block.clip` is an index into them."""
        return tuple(clip["clip"] for clip in self.manifest.clips)

    @property
    def sources(self) -> dict[str, str]:
        """Name of each hurt version of a clip -> name of the healthy clip from which it was made."""
        return {clip["clip"]: clip["source"] for clip in self.manifest.clips if "source" in clip}

    def row_count(self, split: str) -> int:
        """Number of rows (frames) of "train" or "held_out"."""
        return self.manifest.row_count(split)

    def sample_count(self, split: str) -> int:
        """Number of samples of a pass. A sample is a pair of a row and one of its terrain fits.

        A row on flat ground has a single fit, which a pass uses `visits` times.
        """
        return self.row_count(split) * self.manifest.visits

    def section_sample_count(self, split: str, section: int, sections: int) -> int:
        """Number of samples of section number `section`, from 0, of a pass in `sections` sections."""
        total = self.sample_count(split)
        return total * (section + 1) // sections - total * section // sections

    def blocks(
        self,
        split: str,
        pass_index: int,
        section: int,
        sections: int,
        seed: int,
        block_rows: int = BLOCK_ROWS,
        part: range | None = None,
        window: int | None = None,
    ) -> Iterator[Block]:
        """One section of one pass, shuffled, as blocks of `block_rows` rows. The last block may be shorter.

        All sections of a pass together give every sample once, but the single fit of a flat row `visits`
        times. The blocks depend only on the arguments, and on memory_mb if the database does not fit in
        memory. They do not depend on what was read before. A thread makes the next block.

        pass_index, section: number of the pass and of the section, from 0. seed: of the random order.
        part: the numbers of the samples of the section to read; None: all of it. window: number of chunks in
        memory at a time; None: as `chunks_per_window` says. Raises InputError, which names the file, if a
        chunk is damaged.
        """
        if self.row_count(split) == 0:
            return iter(())
        part = range(self.section_sample_count(split, section, sections)) if part is None else part
        spans = order.layer_parts(self.row_count(split), self.manifest.visits, section, sections, part)
        window = window or self.chunks_per_window(split, block_rows)
        groups = [
            group
            for layer, start, stop in spans
            for group in self._chunk_groups(split, (seed, pass_index, layer), start, stop, window)
        ]
        windows = self._windows(split, [chunks for _, chunks, _ in groups], window)
        visits = self.manifest.visits
        picked = (
            (w, *order.rows_and_fits(w.chunks, w.rows, w.count, visits, key, places))
            for (key, _, places), w in zip(groups, windows, strict=True)
        )
        return read_ahead(self._compose_blocks(picked, len(part), block_rows))

    def each_row(self, split: str) -> Iterator[UncomposedRows]:
        """Each row of a split once, with its fits, in the order of the chunks, BLOCK_ROWS at a time."""
        chunks = len(self.manifest.chunks[split])
        window = self.chunks_per_window(split, BLOCK_ROWS)
        groups = [range(chunks)[start : start + window] for start in range(0, chunks, window or 1)]
        for loaded in self._windows(split, groups, window):
            for start in range(0, len(loaded.count), BLOCK_ROWS):
                part = slice(start, start + BLOCK_ROWS)
                first, count = loaded.first_fit[part], loaded.count[part]
                fits = loaded.fits[first[0] : first[-1] + count[-1]].astype(np.float32)
                x, y = (table[part].astype(np.float32) for table in (loaded.x, loaded.y))
                yield UncomposedRows(x, y, loaded.phase[part], loaded.clip[part], fits, first - first[0])

    def _windows(self, split: str, groups: Sequence[Sequence[int]], window: int) -> Iterator[ChunkWindow]:
        """The windows of groups of at most `window` chunks. They stay in memory if all chunks do.

        Otherwise, while one window is in use, a thread loads the next one. There are only two sets of buffers
        for them, so a caller must not use a window after it requested the next one.
        """
        if window >= len(self.manifest.chunks[split]):
            return iter([self._load_split(split)] * len(groups))
        buffers = cycle([empty_buffers(self.manifest, split, window) for _ in range(2)])
        return read_ahead(self.load(split, chunks, next(buffers)) for chunks in groups)

    def _chunk_groups(
        self, split: str, layer_key: tuple[int, int, int], start: int, stop: int, window: int
    ) -> Iterator[tuple[tuple[int, int, int, int], Sequence[int], slice]]:
        """The groups of chunks with the rows at places `start` to `stop` - 1 of a layer.

        layer_key: seed, number of the pass and number of the layer. window: number of chunks in memory at a
        time. Yields (layer_key and number of the group, numbers of its chunks, places in the group).
        """
        rows = [chunk.rows for chunk in self.manifest.chunks[split]]
        if window >= len(rows):
            yield (*layer_key, 0), range(len(rows)), slice(start, stop)
            return
        done = 0
        for group, chunks in enumerate(order.chunk_groups(len(rows), window, *layer_key)):
            group_rows = sum(rows[i] for i in chunks)
            low, high = max(start - done, 0), min(stop - done, group_rows)
            if low < high:
                yield (*layer_key, group), chunks.tolist(), slice(low, high)
            done += group_rows

    def block_rows(self, batch: int = 1) -> int:
        """A good number of rows for a block: a multiple of `batch`, usually close to BLOCK_ROWS.

        It is lower if the blocks would otherwise take more than a quarter of the memory.
        """
        row_bytes = 4 * (self.layout.x_size + self.layout.y_size)
        limit = min(BLOCK_ROWS, (self.memory_mb << 20) // (4 * BLOCKS * row_bytes))
        return batch * max(1, limit // batch)

    def chunks_per_window(self, split: str, block_rows: int) -> int:
        """The number of chunks that may be in memory together: all chunks of the split if both splits fit.

        Otherwise, memory for two such groups is needed, because the next group is read while the present one
        is in use. At least 1. Memory for the blocks, of `block_rows` rows, is subtracted first.
        """
        memory = self.memory_mb << 20
        memory -= BLOCKS * block_rows * 4 * (self.layout.x_size + self.layout.y_size)
        sizes = [chunk.bytes for chunk in self.manifest.chunks[split]]
        return len(sizes) if self.manifest.bytes <= memory else max(1, memory // (2 * max(sizes)))

    def _load_split(self, split: str) -> ChunkWindow:
        """All chunks of a split. They are read at the first call and stay in memory."""
        if split not in self._loaded:
            numbers = range(len(self.manifest.chunks[split]))
            self._loaded[split] = self.load(split, numbers, empty_buffers(self.manifest, split, len(numbers)))
        return self._loaded[split]

    def load(self, split: str, numbers: Sequence[int], into: Buffers) -> ChunkWindow:
        """Read chunks directly into the arrays `into`, from `empty_buffers`. numbers: which chunks.

        Raises InputError, which names the file, if a chunk is damaged. Its checksum is verified once.
        """
        wanted = [self.manifest.chunks[split][i] for i in numbers]
        all_rows, all_fits = sum(c.rows for c in wanted), sum(c.fits for c in wanted)
        tables = {name: table[: all_fits if name == "fits" else all_rows] for name, table in into.items()}
        row = fit = 0  # where the rows and the fits of the next chunk begin
        for chunk in wanted:
            rows, fits = slice(row, row + chunk.rows), slice(fit, fit + chunk.fits)
            parts = {name: table[fits if name == "fits" else rows] for name, table in tables.items()}
            read_chunk(
                self.path / self.manifest.folder, chunk, parts, verify=chunk.file not in self._verified
            )
            self._verified.add(chunk.file)
            row, fit = rows.stop, fits.stop
        for table, columns, factor in self._factors:
            values = tables[table][:, columns]
            changed = values.astype(np.float32) * np.float32(factor)
            values[...] = to_stored_type(changed, self.manifest.dtype)
        return ChunkWindow(numbers, [c.rows for c in wanted], order.first_fits(tables["count"]), **tables)

    def _compose_blocks(self, picked: Iterator[PickedRows], total: int, block_rows: int) -> Iterator[Block]:
        """Blocks of `block_rows` rows. picked: `total` rows, in portions of any length."""
        block, filled = self._empty_block(min(block_rows, total)), 0
        for window, rows, fits in picked:
            while len(rows):
                n = min(len(rows), len(block.p) - filled)
                here, next_rows = slice(filled, filled + n), rows[:n]
                self._compose_rows(window, next_rows, fits[:n], block.x[here], block.y[here])
                block.p[here] = window.phase[next_rows]
                block.clip[here], block.frame[here] = window.clip[next_rows], window.frame[next_rows]
                rows, fits, filled = rows[n:], fits[n:], filled + n
                if filled == len(block.p):
                    yield block
                    total -= filled
                    block, filled = self._empty_block(min(block_rows, total)), 0

    def _compose_rows(
        self, window: ChunkWindow, rows: np.ndarray, fits: np.ndarray, x: Array, y: Array
    ) -> None:
        """Fill x (n, X) and y (n, Y) with n rows of a window, each with one fit.

        rows: (n,) indices of the rows. fits: (n,) indices of their fits. One core composes 2 million rows (31
        joints) a second.
        """
        frames, ground = window.x[rows], window.fits[fits]
        if window.y.dtype == y.dtype:
            np.take(window.y, rows, axis=0, out=y, mode="clip")  # the default mode makes another copy
        else:
            y[...] = window.y[rows]
        lift = ground[:, -1:].astype(np.float32)
        lift_or_none = lift if lift.any() else None  # None skips the subtraction
        stds = self.statistics.x_std, self.statistics.y_std
        compose(self.layout, frames, ground[:, :-1], lift_or_none, x, y, *stds)

    def _empty_block(self, rows: int) -> Block:
        """A block for `rows` rows, not yet filled."""
        x = np.empty((rows, self.layout.x_size), np.float32)
        y = np.empty((rows, self.layout.y_size), np.float32)
        return Block(x, y, np.empty(rows, np.float32), np.empty(rows, np.int32), np.empty(rows, np.int32))


def read_ahead(items: Iterator[Item]) -> Iterator[Item]:
    """Yield the items. A thread makes the next item while the caller uses the present one."""
    nothing = object()  # what `next` returns after the last item
    with ThreadPoolExecutor(1, "ahead") as pool:
        future = pool.submit(next, items, nothing)
        while (item := future.result()) is not nothing:
            future = pool.submit(next, items, nothing)
            yield item  # type: ignore[misc]
