"""Converts rows from the statistics of their shard to those of the whole database.

A shard holds the rows of some clips, standardised by the means and standard deviations of these rows alone. A
reader needs all rows standardised by the same means and deviations, those of the database. Each column is
converted by a multiplication and an addition.
"""

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
from hobble.database.precision import to_floats, to_stored_type
from hobble.database.statistics import Statistics

PART_ROWS = 256  # 16-bit rows are converted so many at a time, so that their float32 copy is small

# (C,) factors and (C,) summands of C columns, float32. A value v becomes v * factor + summand.
FactorsAndSummands = tuple[Array, Array]


@dataclass(frozen=True)
class Conversion:
    """How to convert a shard's rows to the statistics of the whole database.

    x: for the columns of X without terrain. y: for the columns of Y. fits: for the columns of a terrain fit.
    """

    x: FactorsAndSummands = field(repr=False)
    y: FactorsAndSummands = field(repr=False)
    fits: FactorsAndSummands = field(repr=False)

    def apply(self, x: np.ndarray, y: np.ndarray, fits: np.ndarray, dtype: str) -> None:
        """Convert the arrays of a chunk in place. dtype: type of the numbers on disk."""
        for values, factors_and_summands in ((x, self.x), (y, self.y), (fits, self.fits)):
            _convert(values, factors_and_summands, dtype)


def _convert(values: np.ndarray, factors_and_summands: FactorsAndSummands, dtype: str) -> None:
    factor, summand = factors_and_summands
    if values.dtype == np.float32:
        np.multiply(values, factor, out=values)
        np.add(values, summand, out=values)
        return
    for start in range(0, len(values), PART_ROWS):
        part = values[start : start + PART_ROWS]
        part[...] = to_stored_type(to_floats(part).astype(np.float32) * factor + summand, dtype)


def _factors_and_summands(mean: Array, std: Array, to_mean: Array, to_std: Array) -> FactorsAndSummands:
    """How to convert values standardised by (C,) mean and std to values standardised by to_mean and to_std.

    v becomes (v * std + mean - to_mean) / to_std.
    """
    factor, summand = np.float64(std) / to_std, (np.float64(mean) - to_mean) / to_std
    return factor.astype(np.float32), summand.astype(np.float32)


def make_conversion(whole: Statistics, own: Statistics, terrain: slice) -> Conversion | None:
    """The conversion from a shard's statistics (`own`) to those of the database (`whole`).

    None if the statistics are equal. terrain: the terrain columns of X.
    """
    if all(np.array_equal(vars(own)[name], values) for name, values in vars(whole).items()):
        return None
    factor, summand = _factors_and_summands(own.x_mean, own.x_std, whole.x_mean, whole.x_std)
    x = np.delete(factor, terrain), np.delete(summand, terrain)
    y = _factors_and_summands(own.y_mean, own.y_std, whole.y_mean, whole.y_std)
    # The last column of a fit is a height in cm. It is not standardised, so it stays as it is.
    fits = np.append(factor[terrain], np.float32(1)), np.append(summand[terrain], np.float32(0))
    return Conversion(x, y, fits)


class ShardConversions:
    """The conversions of all shards of a database.

    dtype: type of the numbers on disk. conversions: one for each shard, None if a shard needs none.
    first_clip: (shards,) number of each shard's first clip in the database. shard_of_chunk: split ->
    (chunks,) index of each chunk's shard.
    """

    def __init__(self, path: Path, manifest: Manifest, whole: Statistics) -> None:
        """Read the statistics of all shards of the database folder `path`.

        whole: the statistics of the whole database. Raises InputError if the shapes of the arrays in the file
        do not fit the number of shards or of columns.
        """
        data = load_npz(path / manifest.folder / SCALES)
        count, terrain = len(manifest.shards), manifest.layout.x_terrain
        if any(data[name].shape != (count, *values.shape) for name, values in vars(whole).items()):
            raise InputError(
                path / manifest.folder / SCALES, f"not the statistics of {count} shards", fix=HINT
            )
        of_shards = [Statistics(**{name: data[name][n] for name in vars(whole)}) for n in range(count)]
        self.dtype = manifest.dtype
        self.conversions = [make_conversion(whole, own, terrain) for own in of_shards]
        self.first_clip = manifest.first_clip()
        self.shard_of_chunk = {split: manifest.shard_of_chunk(split) for split in SPLITS}

    def convert(self, split: str, chunk: int, tables: Mapping[str, np.ndarray]) -> None:
        """Convert a chunk in place, from its shard's statistics and clip numbers to those of the database.

        chunk: number of the chunk in the split. tables: the arrays of its file, by name. A shard numbers its
        own clips from 0.
        """
        shard = self.shard_of_chunk[split][chunk]
        if (conversion := self.conversions[shard]) is not None:
            conversion.apply(tables["x"], tables["y"], tables["fits"], self.dtype)
        tables["clip"][...] += np.int32(self.first_clip[shard])
