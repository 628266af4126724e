"""Rows of some chunks in memory, and the function that loads them."""

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
from hobble.rows.compose import fit_columns, x_columns

Buffers = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class ChunkWindow:
    """The rows of some chunks, in memory one after another.

    chunks: their numbers in the split. rows: number of rows of each chunk. The arrays hold R rows, and S
    patches of terrain fitted under them, in the types of the chunk files. x: (R, columns of X without
    terrain). y: (R, Y). count: (R,) number of fits of each row. fits: (S, columns) the fits, row after row.
    first: (R,) index of each row's first fit in `fits`. clip, frame, phase: (R,) each row's clip (its
    number in the database), frame in this clip, and phase.
    """

    chunks: Sequence[int]
    rows: Sequence[int]
    first: np.ndarray
    x: Array
    y: Array
    fits: Array
    count: np.ndarray
    clip: np.ndarray
    frame: np.ndarray
    phase: Array


def empty_buffers(manifest: Manifest, split: str, count: int) -> dict[str, np.ndarray]:
    """Empty arrays that are large enough for any `count` chunks of a split.

    Their order is that of the arrays in a chunk file.
    """
    chunks = manifest.chunks[split]
    rows = sum(sorted(chunk.rows for chunk in chunks)[-count:])
    fits = sum(sorted(chunk.fits for chunk in chunks)[-count:])
    floats = STORED[manifest.dtype]
    return {
        "x": np.empty((rows, x_columns(manifest.layout)), floats),
        "y": np.empty((rows, manifest.layout.y_size), floats),
        "fits": np.empty((fits, fit_columns(manifest.layout)), floats),
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
    """Read the chunks with these numbers of a split, one after another, directly into the arrays `into`.

    folder: the chunks' folder. shards: converts the chunks to the statistics of the whole database. verified:
    names of chunk files with a correct checksum. They are not checked again; newly checked ones are added.
    Raises InputError, which names the file, if a chunk is damaged.
    """
    wanted = [manifest.chunks[split][i] for i in numbers]
    all_rows, all_fits = sum(c.rows for c in wanted), sum(c.fits for c in wanted)
    tables = {name: table[: all_fits if name == "fits" else all_rows] for name, table in into.items()}
    row = fit = 0
    for number, chunk in zip(numbers, wanted, strict=True):
        rows, fits = slice(row, row + chunk.rows), slice(fit, fit + chunk.fits)
        parts = {name: table[fits if name == "fits" else rows] for name, table in tables.items()}
        read_chunk(folder, chunk, parts, verify=chunk.file not in verified)
        verified.add(chunk.file)
        shards.convert(split, number, parts)
        row, fit = rows.stop, fits.stop
    return ChunkWindow(numbers, [c.rows for c in wanted], order.starts(tables["count"]), **tables)
