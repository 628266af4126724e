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

BUCKET_BYTES = 64 << 20  # size of a bucket; sorting one needs a few times as much memory

RowSource = ClipRows | str | Path


@dataclass(frozen=True)
class Plan:
    """What a shard will contain.

    layout: of its rows. visits: how often a pass over the data uses each row. clips: for each clip `clip`
    (its name), `split`, `rows` and `pairs` (of a row and a terrain fit), for a hurt version `source`, its
    healthy clip, and if only some of its rows are used `every` and `first_row`: every how many rows one is
    used, and the first. chunk_rows, bucket_rows: number of rows of a chunk and of a bucket.
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

    item: bytes of a number on disk. For the other arguments see `hobble.database.merge.write_database`.
    Raises InputError if a clip does not fit the others.
    """
    entries: list[dict[str, Any]] = []
    first: Outline | None = None
    visits, pairs, rows = 1, 0, 0
    made: Counter[str] = Counter()  # versions of each healthy clip so far: each starts with another row
    for name in sorted(clips):
        one = outline(clips[name])
        first = first or one
        if not fit_together(one, first):
            source = clips[name]
            where = name if isinstance(source, ClipRows) else source
            raise InputError(where, f"the layout of its rows differs from that of {min(clips)}")
        entry: dict[str, Any] = {"clip": name, "split": splits[name]}
        if name in sources:
            entry["source"] = sources[name]
            if every > 1 and splits[name] == "train":
                entry |= {"every": every, "first_row": made[sources[name]] % every}
                made[sources[name]] += 1
        fits = one.fits[used_rows(entry)]
        entries.append(entry | {"rows": len(fits), "pairs": int(fits.sum())})
        visits = max(visits, one.visits, int(fits.max(initial=1)))
        rows, pairs = rows + len(fits), pairs + int(fits.sum())
    if first is None:
        return None
    layout = first.layout.with_channels(channels)
    values = x_columns(layout) + layout.y_size + fit_columns(layout) * pairs / max(rows, 1)
    chunk_rows = max(1, int(chunk_bytes / (item * values + 16)))
    each = max(1, int(BUCKET_BYTES / (chunk_rows * 4 * values)))
    return Plan(layout, first.skeleton, visits, entries, chunk_rows, chunk_rows * each)


def used_rows(entry: Mapping[str, Any]) -> slice:
    """Which rows of a clip are used. entry: the clip's in `Plan.clips`."""
    return slice(entry.get("first_row", 0), None, entry.get("every", 1))


def fit_together(one: Outline | Plan, other: Outline | Plan) -> bool:
    """Whether the rows of both have the same columns and joints."""
    return one.layout == other.layout and list(one.skeleton["joints"]) == list(other.skeleton["joints"])
