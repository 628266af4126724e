"""First step of the shuffle: scatter the rows of clips over buckets.

Each row has a random place in the final order of its split. A bucket collects, on disk, the rows of one
stretch of this order. The second step (`hobble.database.write_in_order`) sorts one bucket at a time, because
all rows together may not fit in memory.
"""

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
from hobble.rows.compose import column_count_without_terrain, fit_column_count, frame_inputs
from hobble.rows.layout import RowLayout

PART_ROWS = 8192  # rows of a clip are scattered so many at a time, to use little memory


def make_buckets(folder: Path, plan: Plan) -> dict[str, Buckets]:
    """Empty buckets for each split, in subfolders of `folder`."""
    columns, fit_size = (
        column_count_without_terrain(plan.layout) + plan.layout.y_size,
        fit_column_count(plan.layout),
    )
    return {
        split: Buckets(
            folder / f"buckets-{split}", plan.row_count(split), plan.bucket_rows, columns, fit_size
        )
        for split in SPLITS
    }


def scatter(
    buckets: Mapping[str, Buckets], clips: Mapping[str, RowSource], plan: Plan, seed: int
) -> Iterator[tuple[dict[str, Any], ClipRows, ClipRows]]:
    """Put the rows of each clip that the plan uses into the buckets of the clip's split.

    clips: name -> rows or their file. seed: of the random places. Yields (the clip's entry in `Plan.clips`,
    all its rows, its used rows) for each clip.
    """
    places = {
        split: np.random.default_rng([seed, number]).permutation(plan.row_count(split))
        for number, split in enumerate(SPLITS)
    }
    done = dict.fromkeys(SPLITS, 0)  # rows of each split that already have a place
    for number, entry in enumerate(plan.clips):
        split, start = entry["split"], done[entry["split"]]
        done[split] += entry["rows"]
        source = clips[entry["clip"]]
        whole = source if isinstance(source, ClipRows) else load_clip_rows(source)
        used = used_rows(entry)
        rows = whole if used.step == 1 else whole.every(used.step, used.start)
        index = np.zeros(len(rows), INDEX)
        index["place"] = places[split][start : done[split]]
        index["count"], index["clip"] = rows.fits, number
        index["frame"], index["phase"] = rows.frame, rows.p
        for first in range(0, len(rows), PART_ROWS):
            part = slice(first, first + PART_ROWS)
            buckets[split].add(*_frames_and_fits(rows, part, plan.layout), index[part])
        yield entry, whole, rows


def _frames_and_fits(clip: ClipRows, part: slice, layout: RowLayout) -> tuple[Array, Array]:
    """Some rows of a clip, not standardised, as two arrays for `Buckets.add`: frames and fits.

    part: which n rows. Frames (n, columns): the columns of X without terrain, then those of Y. Fits (m,
    columns): a line for each terrain fit of these rows, with the ground heights, then their mean on the path.
    """
    values = {name: clip.channels[name][part] for name, _ in layout.channels}
    frames = np.concatenate([frame_inputs(layout, clip.x[part], values), clip.y[part]], axis=1)
    first = clip.first_fit[part]
    ground = slice(int(first[0]), int(first[-1] + clip.fits[part][-1]))
    return frames, np.concatenate([clip.heights[ground], clip.mean[ground, None]], axis=1)
