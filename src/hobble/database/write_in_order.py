"""Second step of the shuffle: sort the rows of each bucket, standardise them and write chunks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from hobble.database.buckets import Buckets
from hobble.database.chunks import Chunk, write_chunk
from hobble.database.plan import Plan
from hobble.database.precision import narrow
from hobble.database.standardise import standardise_rows
from hobble.database.statistics import Statistics
from hobble.rows.compose import x_columns


def write_chunks(
    work: Path, split: str, buckets: Buckets, plan: Plan, statistics: Statistics, dtype: str
) -> Iterator[Chunk]:
    """Write each bucket, sorted and standardised, as chunks of `plan.chunk_rows` rows to folder `work`."""
    columns, number = x_columns(plan.layout), 0
    for frames, fits, index in buckets.drain():
        ends = np.cumsum(index["count"])
        for start in range(0, len(index), plan.chunk_rows):
            part = slice(start, min(start + plan.chunk_rows, len(index)))
            count = index["count"][part]
            fit_part = slice(int(ends[start] - count[0]), int(ends[part.stop - 1]))
            raw = frames[part, :columns], frames[part, columns:], fits[fit_part]
            x, y, ground = standardise_rows(plan.layout, statistics, *raw, count)
            arrays = {
                "x": narrow(x, dtype),
                "y": narrow(y, dtype),
                "fits": narrow(ground, dtype),
                "count": count,
                "clip": index["clip"][part],
                "frame": index["frame"][part],
                "phase": index["phase"][part],
            }
            yield write_chunk(work, f"{split}/{number:05d}.safetensors", arrays)
            number += 1
