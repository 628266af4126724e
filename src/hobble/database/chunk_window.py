"""Loads the rows of some chunks into memory. A chunk is a file of a few MB with rows of a database."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hobble.core.quat import Array
from hobble.database import order
from hobble.database.chunks import read_chunk
from hobble.database.manifest import Manifest
from hobble.database.precision import STORED
from hobble.database.scale import ShardConversions
from hobble.rows.compose import column_count_without_terrain, fit_column_count

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


def load_chunks(
    folder: Path,
    manifest: Manifest,
    split: str,
    numbers: Sequence[int],
    into: Buffers,
    shards: ShardConversions,
    verified: set[str],
) -> ChunkWindow:
    """Read some chunks of a split, one after another, directly into the arrays `into` (`empty_buffers`).

    folder: the chunks' folder. numbers: the numbers of the chunks. shards: converts the rows, which are
    standardised by the statistics of their shard (a part of the database), to the statistics of the whole
    database. verified: names of chunk files with a correct checksum, which are not checked again. The names
    of the files read are added to it. Raises InputError, which names the file, if a chunk is damaged.
    """
    wanted = [manifest.chunks[split][i] for i in numbers]
    all_rows, all_fits = sum(c.rows for c in wanted), sum(c.fits for c in wanted)
    tables = {name: table[: all_fits if name == "fits" else all_rows] for name, table in into.items()}
    row = fit = 0  # where the rows and the fits of the next chunk begin
    for number, chunk in zip(numbers, wanted, strict=True):
        rows, fits = slice(row, row + chunk.rows), slice(fit, fit + chunk.fits)
        parts = {name: table[fits if name == "fits" else rows] for name, table in tables.items()}
        read_chunk(folder, chunk, parts, verify=chunk.file not in verified)
        verified.add(chunk.file)
        shards.convert(split, number, parts)
        row, fit = rows.stop, fits.stop
    return ChunkWindow(numbers, [c.rows for c in wanted], order.first_fits(tables["count"]), **tables)
