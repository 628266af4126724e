"""The plan of a database, made before any row is written: layout, clips, sizes of chunks and buckets."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import read_json, write_json
from hobble.rows.clip_rows import ClipRows, Outline, outline
from hobble.rows.compose import fit_columns, x_columns
from hobble.rows.layout import RowLayout

BUCKET_BYTES = 64 << 20  # of a bucket; pass 2 needs a few times as much memory

Source = ClipRows | str | Path


@dataclass(frozen=True)
class Plan:
    """Layout of the rows, clips with their rows, and rows of a chunk and of a bucket."""

    layout: RowLayout
    skeleton: Mapping[str, Any]
    visits: int
    clips: list[dict[str, Any]]
    chunk_rows: int
    bucket_rows: int

    def rows(self, split: str) -> int:
        """Rows of a split."""
        return sum(clip["rows"] for clip in self.clips if clip["split"] == split)

    @property
    def original_bytes(self) -> int:
        """Size of the same pairs in the original's layout: each a row of X, Y and P in float32."""
        values = self.layout.x_size + self.layout.y_size + 1
        return 4 * values * self.visits * sum(clip["rows"] for clip in self.clips)

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        # As text: write_json sorts keys, but the joints have to keep their order.
        skeleton = json.dumps(self.skeleton)
        write_json(path, {**vars(self), "layout": self.layout.to_dict(), "skeleton": skeleton})

    @classmethod
    def load(cls, path: Path) -> Plan:
        """The inverse of `save`."""
        values = read_json(path)
        values["layout"] = RowLayout.from_dict(values["layout"])
        return cls(**{**values, "skeleton": json.loads(values["skeleton"])})


def make_plan(
    clips: Mapping[str, Source],
    splits: Mapping[str, str],
    channels: Sequence[str],
    item: int,
    chunk_bytes: int,
) -> Plan:
    """The plan of rows by clip name; see `hobble.database.merge.write_database`.

    item: bytes of a number on disk. Raises HobbleError if no training clip has rows, InputError if a clip
    does not fit the others.
    """
    entries: list[dict[str, Any]] = []
    first: Outline | None = None
    visits, pairs, rows = 1, 0, 0
    for name in sorted(clips):
        one = outline(clips[name])
        first = first or one
        if one.layout != first.layout or list(one.skeleton["joints"]) != list(first.skeleton["joints"]):
            source = clips[name]
            where = name if isinstance(source, ClipRows) else source
            raise InputError(where, f"the layout of its rows differs from that of {min(clips)}")
        fits = int(one.fits.sum())
        entries.append({"clip": name, "split": splits[name], "rows": len(one.fits), "pairs": fits})
        visits = max(visits, one.visits, int(one.fits.max(initial=1)))
        rows, pairs = rows + len(one.fits), pairs + fits
    if first is None or not any(e["rows"] for e in entries if e["split"] == "train"):
        raise HobbleError(
            "There is nothing to train on: no clip of the training part has a whole locomotion "
            "cycle. Add clips, or hold fewer out."
        )
    layout = first.layout.with_channels(channels)
    values = x_columns(layout) + layout.y_size + fit_columns(layout) * pairs / rows
    chunk_rows = max(1, int(chunk_bytes / (item * values + 16)))
    each = max(1, int(BUCKET_BYTES / (chunk_rows * 4 * values)))
    return Plan(layout, first.skeleton, visits, entries, chunk_rows, chunk_rows * each)
