"""Converts rows that are standardised by their shard's statistics to the statistics of the whole database."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.database.chunks import HINT
from hobble.database.manifest import SCALES, SPLITS, Manifest
from hobble.database.precision import narrow, widen
from hobble.database.statistics import Statistics

PART_ROWS = 256  # so many rows of half precision are converted at a time

Line = tuple[Array, Array]  # factor and summand of each column, float32: v becomes v * factor + summand


@dataclass(frozen=True)
class Scale:
    """The conversion of a shard's rows to the statistics of the whole database.

    x, y, fits: factors and summands of the columns of X without terrain, of Y and of the terrain fits.
    """

    x: Line = field(repr=False)
    y: Line = field(repr=False)
    fits: Line = field(repr=False)

    def apply(self, x: np.ndarray, y: np.ndarray, fits: np.ndarray, dtype: str) -> None:
        """Convert the arrays of a chunk in place. dtype: type of the numbers on disk."""
        for values, line in ((x, self.x), (y, self.y), (fits, self.fits)):
            _apply(values, line, dtype)


def _apply(values: np.ndarray, line: Line, dtype: str) -> None:
    factor, summand = line
    if values.dtype == np.float32:
        np.multiply(values, factor, out=values)
        np.add(values, summand, out=values)
        return
    for start in range(0, len(values), PART_ROWS):
        part = values[start : start + PART_ROWS]
        part[...] = narrow(widen(part).astype(np.float32) * factor + summand, dtype)


def _line(mean: Array, std: Array, to_mean: Array, to_std: Array) -> Line:
    """The conversion of values standardised by mean and std to values standardised by to_mean and to_std."""
    factor, summand = np.float64(std) / to_std, (np.float64(mean) - to_mean) / to_std
    return factor.astype(np.float32), summand.astype(np.float32)


def scale_to(whole: Statistics, own: Statistics, terrain: slice) -> Scale | None:
    """The conversion from a shard's statistics (`own`) to those of the database (`whole`); None if equal.

    terrain: the terrain columns of X.
    """
    if all(np.array_equal(vars(own)[name], values) for name, values in vars(whole).items()):
        return None
    factor, summand = _line(own.x_mean, own.x_std, whole.x_mean, whole.x_std)
    rows = np.delete(factor, terrain), np.delete(summand, terrain)
    # The last column of the fits is a height in cm, which is not standardised.
    fits = np.append(factor[terrain], np.float32(1)), np.append(summand[terrain], np.float32(0))
    return Scale(rows, _line(own.y_mean, own.y_std, whole.y_mean, whole.y_std), fits)


class Shards:
    """The conversions of all shards of a database.

    dtype: type of the numbers on disk. scale: the conversion of each shard, or None if it needs none. first:
    (shards,) number of each shard's first clip. of_chunks: split -> (chunks,) the shard of each chunk.
    """

    def __init__(self, path: Path, manifest: Manifest, whole: Statistics) -> None:
        """Read the scales of the database `path`. Raises InputError if their shapes do not fit its shards."""
        data = load_npz(path / manifest.folder / SCALES)
        count, terrain = len(manifest.shards), manifest.layout.x_terrain
        if any(data[name].shape != (count, *values.shape) for name, values in vars(whole).items()):
            raise InputError(path / manifest.folder / SCALES, f"not the scales of {count} shards", fix=HINT)
        of_shards = [Statistics(**{name: data[name][n] for name in vars(whole)}) for n in range(count)]
        self.dtype, self.scale = manifest.dtype, [scale_to(whole, own, terrain) for own in of_shards]
        self.first = manifest.first_clip()
        self.of_chunks = {split: manifest.shard_of_chunk(split) for split in SPLITS}

    def convert(self, split: str, chunk: int, tables: Mapping[str, np.ndarray]) -> None:
        """Convert the arrays of a chunk in place: its rows to the statistics of the whole database, its clip
        numbers from those of its shard to those of the database.
        """
        shard = self.of_chunks[split][chunk]
        if (scale := self.scale[shard]) is not None:
            scale.apply(tables["x"], tables["y"], tables["fits"], self.dtype)
        tables["clip"][...] += np.int32(self.first[shard])
