"""Excerpts of clips. A sample of a large data set consists of excerpts, so that no long clip is read whole.

A clip is cut into excerpts of equal length, of at most LONGEST rows. A shorter clip is one excerpt.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hobble.core.errors import InputError
from hobble.rows.clip_rows import DELETE_IT, ClipRows, load_clip_rows
from hobble.rows.compose import body_layout
from hobble.rows.layout import GAITS

LONGEST = 1200  # rows, 20 seconds: an excerpt has several steps, and an hour has many excerpts


class Excerpt(NamedTuple):
    """Rows of a clip. first: index of the first. rows: how many. clip_rows: how many the whole clip has."""

    clip: str
    first: int
    rows: int
    clip_rows: int

    @property
    def whole(self) -> bool:
        """Whether it is the whole clip."""
        return self.rows == self.clip_rows

    @property
    def stop(self) -> int:
        """The first row after it."""
        return self.first + self.rows


@dataclass(frozen=True)
class ExcerptKind:
    """What is in an excerpt.

    gait: the gait with the largest share. speed: mean speed of the root, cm a frame. channels: names of the
    channels with a value above 0 in some row.
    """

    gait: str
    speed: float
    channels: tuple[str, ...]


def excerpts(clip: str, rows: int, longest: int = LONGEST) -> list[Excerpt]:
    """The excerpts of a clip of `rows` rows. Their lengths differ by at most one row.

    >>> [(one.first, one.rows) for one in excerpts("walk", 2500)]
    [(0, 833), (833, 833), (1666, 834)]
    >>> excerpts("empty", 0)
    []
    """
    count = -(-rows // longest)
    edges = [rows * i // count for i in range(count + 1)] if count else []
    return [Excerpt(clip, a, b - a, rows) for a, b in pairwise(edges)]


def excerpt_kind(rows: ClipRows, first: int, stop: int) -> ExcerptKind:
    """What is in the rows from `first` up to `stop`, which is not included; at least one row."""
    layout, part = rows.layout, slice(first, stop)
    channels = tuple(name for name, values in rows.channels.items() if np.any(values[part] != 0))
    shares = rows.x[part, body_layout(layout).x_gait].reshape(stop - first, len(GAITS), layout.samples)
    gait = GAITS[int(shares[:, :, layout.samples // 2].mean(axis=0).argmax())]
    speed = np.hypot(*rows.y[part, layout.y_root_velocity].astype(float).T).mean()
    return ExcerptKind(gait, float(speed), channels)


def load_excerpt(path: str | Path, one: Excerpt, before: int = 0, after: int = 0) -> ClipRows:
    """The rows of an excerpt, and up to `before` and `after` rows of the same clip around it.

    Only these rows are read from the file. Raises InputError if the file is damaged, or if the clip does not
    have `one.clip_rows` rows.
    """
    first, stop = max(0, one.first - before), min(one.clip_rows, one.stop + after)
    rows = load_clip_rows(path, None if stop - first == one.clip_rows else (first, stop))
    if len(rows) != stop - first:
        raise InputError(
            path, f"does not have as many rows as its summary says ({one.clip_rows})", fix=DELETE_IT
        )
    return rows
