"""First step of the shuffle: scatter the rows of clips over buckets, by their places in the final order."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.database.buckets import INDEX, Buckets
from hobble.database.manifest import SPLITS
from hobble.database.plan import Plan, RowSource, used_rows
from hobble.rows.clip_rows import ClipRows, load_clip_rows
from hobble.rows.compose import fit_columns, frame_inputs, x_columns
from hobble.rows.layout import RowLayout

PART_ROWS = 8192  # so many rows of a clip are scattered at a time


def make_buckets(folder: Path, plan: Plan) -> dict[str, Buckets]:
    """Empty buckets for each split, in subfolders of `folder`."""
    columns, fit_size = x_columns(plan.layout) + plan.layout.y_size, fit_columns(plan.layout)
    return {
        split: Buckets(folder / f"buckets-{split}", plan.rows(split), plan.bucket_rows, columns, fit_size)
        for split in SPLITS
    }


def scatter(
    buckets: Mapping[str, Buckets], clips: Mapping[str, RowSource], plan: Plan, seed: int
) -> Iterator[tuple[dict[str, Any], ClipRows, ClipRows]]:
    """Put the used rows of each clip into the buckets of its split.

    A permutation of all rows of a split gives each row its place in the final order. Yields for each clip its
    entry in the plan, all its rows, and its used rows.
    """
    places = {
        split: np.random.default_rng([seed, number]).permutation(plan.rows(split))
        for number, split in enumerate(SPLITS)
    }
    done = dict.fromkeys(SPLITS, 0)
    for number, entry in enumerate(plan.clips):
        split, start = entry["split"], done[entry["split"]]
        done[split] += entry["rows"]
        source = clips[entry["clip"]]
        whole = source if isinstance(source, ClipRows) else load_clip_rows(source)
        used = used_rows(entry)
        clip = whole if used.step == 1 else whole.every(used.step, used.start)
        index = np.zeros(len(clip), INDEX)
        index["place"] = places[split][start : done[split]]
        index["count"], index["clip"] = clip.fits, number
        index["frame"], index["phase"] = clip.frame, clip.p
        for first in range(0, len(clip), PART_ROWS):
            part = slice(first, first + PART_ROWS)
            buckets[split].add(*_tables(clip, part, plan.layout), index[part])
        yield entry, whole, clip


def _tables(clip: ClipRows, part: slice, layout: RowLayout) -> tuple[Array, Array]:
    """Arrays of some rows for `Buckets.add`, not standardised.

    The frames (n, columns) have the columns of X without terrain, then those of Y. The fits have the ground
    heights, then their mean.
    """
    values = {name: clip.channels[name][part] for name, _ in layout.channels}
    frames = np.concatenate([frame_inputs(layout, clip.x[part], values), clip.y[part]], axis=1)
    first = clip.first_fit[part]
    ground = slice(int(first[0]), int(first[-1] + clip.fits[part][-1]))
    return frames, np.concatenate([clip.heights[ground], clip.mean[ground, None]], axis=1)
