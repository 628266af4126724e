"""The file manifest.json of a database: what the database contains.

A database is made by merging shards. Each shard has the rows of some clips, in files called chunks. The
manifest is written last, so a folder without it is not a complete database.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import read_json, write_json
from hobble.database.chunks import HINT, Chunk
from hobble.rows.layout import RowLayout

FILE = "manifest.json"
STATISTICS = "statistics.npz"  # means and deviations of all training rows
SCALES = "scales.npz"  # for each shard, the statistics with which its chunks are standardised
VERSION = 2  # of the database's format
SPLITS = ("train", "held_out")


@dataclass(frozen=True)
class ShardCounts:
    """How many clips a shard has, and how many chunks it has in each of the splits `train` and `held_out`."""

    clips: int
    train: int
    held_out: int


@dataclass(frozen=True)
class Manifest:
    """What a database contains.

    folder: subfolder with the chunks and statistics. Its name contains a hash of their content.
    layout: the columns of the rows that a network gets. skeleton: see `Skeleton.to_dict`.
    visits: how often a pass over the data uses each row. dtype: type of the numbers on disk.
    joint_weight: factor by which the standardised joints in the network's input are multiplied.
    clips: one entry for each clip, shard after shard: `clip` (its name), `split`, number of `rows` and of
    `pairs` (of a row and one of its terrain fits), and for a hurt version `source`, the name of the healthy
    clip from which it was computed.
    shards: number of clips and of chunks of each shard.
    chunks: split -> its chunks, shard after shard. Each chunk file numbers the clips of its shard from 0.
    original_bytes: size of the same data in the layout of Holden et al. (2017), which has each row `visits`
    times. bytes: size of all chunks. limits: channel -> speed limits (`hobble.channels.speed_limits`).
    """

    folder: str
    layout: RowLayout
    skeleton: Mapping[str, Any]
    visits: int
    dtype: str
    joint_weight: float
    clips: list[dict[str, Any]]
    shards: list[ShardCounts]
    chunks: Mapping[str, list[Chunk]]
    original_bytes: int
    bytes: int
    limits: Mapping[str, Any] = field(default_factory=dict)

    def row_count(self, split: str) -> int:
        """Number of rows of a split."""
        return sum(chunk.rows for chunk in self.chunks[split])

    def shard_of_chunk(self, split: str) -> np.ndarray:
        """(chunks,) the number of the shard of each chunk of a split."""
        return np.repeat(np.arange(len(self.shards)), [getattr(shard, split) for shard in self.shards])

    def first_clip(self) -> np.ndarray:
        """(shards,) the index in `clips` of each shard's first clip."""
        count = np.array([shard.clips for shard in self.shards])
        return np.cumsum(count) - count

    def save(self, path: Path) -> None:
        """Write manifest.json into the database folder `path`, completely or not at all."""
        values = {**vars(self), "format": "hobble database", "version": VERSION}
        values["layout"] = self.layout.to_dict()
        # The skeleton is stored as text, because write_json sorts keys, but joints have to keep their order.
        values["skeleton"] = json.dumps(self.skeleton)
        values["shards"] = [asdict(shard) for shard in self.shards]
        values["chunks"] = {split: [c.to_dict() for c in chunks] for split, chunks in self.chunks.items()}
        write_json(path / FILE, values)

    @classmethod
    def load(cls, path: Path) -> Manifest:
        """Read the manifest of the database folder `path`. Raises InputError if it is missing or wrong."""
        file = path / FILE
        if not file.exists():
            raise InputError(
                path, f"not a complete database: it has no {FILE}, so its build did not finish", fix=HINT
            )
        values = read_json(file)
        try:
            if values.pop("format") != "hobble database" or values.pop("version") != VERSION:
                raise InputError(file, f"not a database of format version {VERSION}", fix=HINT)
            values["layout"] = RowLayout.from_dict(values["layout"])
            values["skeleton"] = json.loads(values["skeleton"])
            values["shards"] = [ShardCounts(**shard) for shard in values["shards"]]
            chunks = values["chunks"]
            values["chunks"] = {split: [Chunk(**chunk) for chunk in chunks[split]] for split in SPLITS}
            return cls(**values)
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(file, f"not a database's manifest ({error})", fix=HINT) from error
