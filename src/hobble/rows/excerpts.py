"""Cuts clips into excerpts, from which a sample of a large data set is drawn.

With excerpts, a long clip need not be read whole. A clip is cut into as few excerpts as possible, of about
equal length. A short clip is one excerpt.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from hobble.core.errors import InputError
from hobble.rows.clip_rows import DELETE_IT, ClipRows, load_clip_rows
from hobble.rows.compose import body_layout
from hobble.rows.layout import GAITS

# An excerpt has at most this many rows. 1200 rows are 20 seconds, which is long enough for several steps. It
# is also short enough to cut an hour of walking into many excerpts.
LONGEST = 1200


class Excerpt(NamedTuple):
    """Consecutive rows of a clip.

    clip: name of the clip. first: index of the excerpt's first row in the clip. rows: number of rows of the
    excerpt. clip_rows: number of rows of the whole clip.
    """

    clip: str
    first: int
    rows: int
    clip_rows: int

    @property
    def is_whole_clip(self) -> bool:
        """Whether the excerpt is the whole clip."""
        return self.rows == self.clip_rows

    @property
    def stop(self) -> int:
        """Index in the clip of the first row after the excerpt."""
        return self.first + self.rows


@dataclass(frozen=True)
class ExcerptKind:
    """What kind of motion is in an excerpt.

    gait: the gait with the largest mean share. speed: mean speed of the root, cm a frame. channels: names of
    the channels that have a value other than 0 in some row.
    """

    gait: str
    speed: float
    channels: tuple[str, ...]


def cut_into_excerpts(clip: str, rows: int, longest: int = LONGEST) -> list[Excerpt]:
    """Cut a clip of `rows` rows into excerpts of at most `longest` rows each.

    The lengths of the excerpts differ by at most one row.

    >>> [(excerpt.first, excerpt.rows) for excerpt in cut_into_excerpts("walk", 2500)]
    [(0, 833), (833, 833), (1666, 834)]
    >>> cut_into_excerpts("empty", 0)
    []
    """
    count = -(-rows // longest)  # rows / longest, rounded up
    edges = [rows * i // count for i in range(count + 1)] if count else []
    return [Excerpt(clip, a, b - a, rows) for a, b in pairwise(edges)]


def excerpt_kind(rows: ClipRows, first: int, stop: int) -> ExcerptKind:
    """What kind of motion is in the rows from `first` up to `stop`, which is not included.

    There has to be at least one such row.
    """
    layout, part = rows.layout, slice(first, stop)
    channels = tuple(name for name, values in rows.channels.items() if np.any(values[part] != 0))
    shares = rows.x[part, body_layout(layout).x_gait].reshape(stop - first, len(GAITS), layout.samples)
    # Of the samples around each frame, the middle one is the frame itself.
    gait = GAITS[int(shares[:, :, layout.samples // 2].mean(axis=0).argmax())]
    speed = np.hypot(*rows.y[part, layout.y_root_velocity].astype(float).T).mean()
    return ExcerptKind(gait, float(speed), channels)


def load_excerpt(path: str | Path, excerpt: Excerpt, before: int = 0, after: int = 0) -> ClipRows:
    """Read the rows of an excerpt, with neighbouring rows of its clip.

    path: the clip's file of rows. before, after: how many rows before and after the excerpt to add, if the
    clip has them. Only these rows are read from the file. Raises InputError if the file is damaged, or if the
    clip does not have `excerpt.clip_rows` rows.
    """
    first, stop = max(0, excerpt.first - before), min(excerpt.clip_rows, excerpt.stop + after)
    rows = load_clip_rows(path, None if stop - first == excerpt.clip_rows else (first, stop))
    if len(rows) != stop - first:
        raise InputError(
            path, f"does not have as many rows as its summary says ({excerpt.clip_rows})", fix=DELETE_IT
        )
    return rows


def shuffle_key(name: str) -> bytes:
    """A key for sorting names. The order looks random, but a new name does not change that of the others."""
    return hashlib.sha256(name.encode()).digest()
