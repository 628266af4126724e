"""The plan of a shard, made before any row is written: layout, clips, sizes of chunks and buckets.

A shard is a part of a database, with the rows of some clips in files called chunks. Buckets are temporary
files in which the rows are sorted before chunks are written.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hobble.core.errors import InputError
from hobble.rows.clip_rows import ClipRows, Outline, read_outline
from hobble.rows.compose import column_count_without_terrain, fit_column_count
from hobble.rows.layout import RowLayout

# Size of a bucket (`hobble.database.buckets`). Sorting a bucket needs a few times as much memory.
BUCKET_BYTES = 64 << 20
INDEX_BYTES = 16  # in a chunk, for each row: its number of terrain fits, clip, frame and phase

# The rows of a clip, or the path of the file with them.
RowSource = ClipRows | str | Path


@dataclass(frozen=True)
class Plan:
    """What a shard will contain.

    layout: the columns of its rows. skeleton: see `Skeleton.to_dict`. visits: how often a pass over the data
    uses each row. clips: one entry for each clip: `clip` (its name), `split`, number of used `rows` and of
    `pairs` (of a used row and one of its terrain fits), and for a hurt version `source`, the name of the
    healthy clip from which it was computed. If an entry has `every` and `first_row`, only each `every`-th row
    from row `first_row` on is used. chunk_rows, bucket_rows: number of rows of a chunk and of a bucket.
    """

    layout: RowLayout
    skeleton: Mapping[str, Any]
    visits: int
    clips: list[dict[str, Any]]
    chunk_rows: int
    bucket_rows: int

    def row_count(self, split: str) -> int:
        """Number of used rows in a split ("train" or "held_out")."""
        return sum(clip["rows"] for clip in self.clips if clip["split"] == split)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for a file."""
        # The skeleton is stored as text, because write_json sorts keys, but joints have to keep their order.
        skeleton = json.dumps(self.skeleton)
        return {**vars(self), "layout": self.layout.to_dict(), "skeleton": skeleton}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Plan:
        """The inverse of `to_dict`."""
        layout, skeleton = RowLayout.from_dict(values["layout"]), json.loads(values["skeleton"])
        return cls(**{**values, "layout": layout, "skeleton": skeleton})


def make_plan(
    clips: Mapping[str, RowSource],
    splits: Mapping[str, str],
    channels: Sequence[str],
    number_bytes: int,
    chunk_bytes: int,
    sources: Mapping[str, str],
    every: int = 1,
) -> Plan | None:
    """The plan of a shard with the rows of `clips`; None if there are no clips.

    number_bytes: bytes of a number on disk. For the other arguments see
    `hobble.database.merge.write_database`. Raises InputError if the rows of a clip have other columns or
    joints than those of the first clip.
    """
    entries: list[dict[str, Any]] = []
    first: Outline | None = None
    visits, pairs, rows = 1, 0, 0
    # Healthy clip -> number of its hurt versions so far. Each version begins at another row, so that the
    # versions of a clip use different frames.
    versions: Counter[str] = Counter()
    for name in sorted(clips):
        current = read_outline(clips[name])
        first = first or current
        if not have_same_columns(current, first):
            source = clips[name]
            where = name if isinstance(source, ClipRows) else source
            raise InputError(where, f"the layout of its rows differs from that of {min(clips)}")
        entry: dict[str, Any] = {"clip": name, "split": splits[name]}
        if name in sources:
            entry["source"] = sources[name]
            if every > 1 and splits[name] == "train":
                entry |= {"every": every, "first_row": versions[sources[name]] % every}
                versions[sources[name]] += 1
        fits = current.fits[used_rows(entry)]
        entries.append(entry | {"rows": len(fits), "pairs": int(fits.sum())})
        visits = max(visits, current.visits, int(fits.max(initial=1)))
        rows, pairs = rows + len(fits), pairs + int(fits.sum())
    if first is None:
        return None
    layout = first.layout.with_channels(channels)
    # How many numbers a row has on average, with its fits.
    row_numbers = (
        column_count_without_terrain(layout) + layout.y_size + fit_column_count(layout) * pairs / max(rows, 1)
    )
    chunk_rows = max(1, int(chunk_bytes / (number_bytes * row_numbers + INDEX_BYTES)))
    bucket_chunks = max(1, int(BUCKET_BYTES / (chunk_rows * 4 * row_numbers)))
    return Plan(layout, first.skeleton, visits, entries, chunk_rows, chunk_rows * bucket_chunks)


def used_rows(entry: Mapping[str, Any]) -> slice:
    """The rows of a clip that are used, as a slice. entry: the clip's entry in `Plan.clips`."""
    return slice(entry.get("first_row", 0), None, entry.get("every", 1))


def have_same_columns(one: Outline | Plan, other: Outline | Plan) -> bool:
    """Whether the rows of `one` and `other` have the same columns and joints."""
    return one.layout == other.layout and list(one.skeleton["joints"]) == list(other.skeleton["joints"])
