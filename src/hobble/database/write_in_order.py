"""Second step of the shuffle: sort the rows of each bucket, standardise them and write them as chunks.

The rows of a bucket are sorted by their places in the final order, which the first step
(`hobble.database.scatter`) has drawn at random.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hobble.database.buckets import Buckets
from hobble.database.chunks import Chunk, write_chunk
from hobble.database.plan import Plan
from hobble.database.precision import to_stored_type
from hobble.database.standardise import standardise_rows
from hobble.database.statistics import Statistics
from hobble.rows.compose import column_count_without_terrain


def write_chunks(
    folder: Path, split: str, buckets: Buckets, plan: Plan, statistics: Statistics, dtype: str
) -> Iterator[Chunk]:
    """Write the rows of one split, standardised, to chunk files in the subfolder `split` of `folder`.

    A chunk has up to `plan.chunk_rows` rows of one bucket. split: "train" or "held_out". buckets: the rows.
    They are deleted. dtype: type of the stored numbers. Yields a description of each chunk.
    """
    columns, number = column_count_without_terrain(plan.layout), 0
    for frames, fits, index in buckets.drain():  # one bucket at a time, sorted
        ends = np.cumsum(index["count"])
        for start in range(0, len(index), plan.chunk_rows):
            part = slice(start, min(start + plan.chunk_rows, len(index)))
            count = index["count"][part]
            fit_part = slice(int(ends[start] - count[0]), int(ends[part.stop - 1]))
            raw = frames[part, :columns], frames[part, columns:], fits[fit_part]
            x, y, ground = standardise_rows(plan.layout, statistics, *raw, count)
            arrays = {
                "x": to_stored_type(x, dtype),
                "y": to_stored_type(y, dtype),
                "fits": to_stored_type(ground, dtype),
                "count": count,
                "clip": index["clip"][part],
                "frame": index["frame"][part],
                "phase": index["phase"][part],
            }
            yield write_chunk(folder, f"{split}/{number:05d}.safetensors", arrays)
            number += 1
