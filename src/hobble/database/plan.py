"""The plan of a shard, made before any row is written: layout, clips, sizes of chunks and buckets."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hobble.core.errors import InputError
from hobble.rows.clip_rows import ClipRows, Outline, outline
from hobble.rows.compose import fit_columns, x_columns
from hobble.rows.layout import RowLayout

# Size of a bucket (`hobble.database.buckets`). Sorting a bucket needs a few times as much memory.
BUCKET_BYTES = 64 << 20
INDEX_BYTES = 16  # of a row: its number of fits, clip, frame and phase

# The rows of a clip, or the file with them.
RowSource = ClipRows | str | Path


@dataclass(frozen=True)
class Plan:
    """What a shard will contain.

    layout: the columns of its rows. skeleton: as plain data. visits: how often a pass over the data uses each
    row. clips: one entry for each clip: `clip` (its name), `split`, number of used `rows` and of `pairs` (of
    a row and a terrain fit), and for a hurt version `source`, the healthy clip it was made from. An entry
    with `every` and `first_row` uses only each `every`-th row from row `first_row` on. chunk_rows,
    bucket_rows: number of rows of a chunk and of a bucket.
    """

    layout: RowLayout
    skeleton: Mapping[str, Any]
    visits: int
    clips: list[dict[str, Any]]
    chunk_rows: int
    bucket_rows: int

    def rows(self, split: str) -> int:
        """Number of rows of a split."""
        return sum(clip["rows"] for clip in self.clips if clip["split"] == split)

    def to_dict(self) -> dict[str, Any]:
        """Plain data for a file."""
        # The skeleton as text: write_json sorts keys, but the joints have to keep their order.
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
    item: int,
    chunk_bytes: int,
    sources: Mapping[str, str],
    every: int = 1,
) -> Plan | None:
    """The plan of a shard with the rows of `clips`; None if there are no clips.

    item: bytes of a number on disk. The other arguments are those of `hobble.database.merge.write_database`.
    Raises InputError if the rows of a clip have other columns or joints than those of the first clip.
    """
    entries: list[dict[str, Any]] = []
    first: Outline | None = None
    visits, pairs, rows = 1, 0, 0
    versions: Counter[str] = Counter()  # healthy clip -> number of its hurt versions so far
    for name in sorted(clips):
        current = outline(clips[name])
        first = first or current
        if not fit_together(current, first):
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
    # how many numbers a row has, with the mean number of fits
    values = x_columns(layout) + layout.y_size + fit_columns(layout) * pairs / max(rows, 1)
    chunk_rows = max(1, int(chunk_bytes / (item * values + INDEX_BYTES)))
    bucket_chunks = max(1, int(BUCKET_BYTES / (chunk_rows * 4 * values)))
    return Plan(layout, first.skeleton, visits, entries, chunk_rows, chunk_rows * bucket_chunks)


def used_rows(entry: Mapping[str, Any]) -> slice:
    """Which rows of a clip are used. entry: the clip's entry in `Plan.clips`."""
    return slice(entry.get("first_row", 0), None, entry.get("every", 1))


def fit_together(one: Outline | Plan, other: Outline | Plan) -> bool:
    """Whether the rows of `one` and `other` have the same columns and joints."""
    return one.layout == other.layout and list(one.skeleton["joints"]) == list(other.skeleton["joints"])
