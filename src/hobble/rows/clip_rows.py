"""The rows of one clip: a row for each frame of its cycles.

Each row has several terrain fits. A fit is a set of ground heights that suit the motion. Values that depend
only on the frame are stored once for each row. Values that depend on the fit are stored once for each fit.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field

from hobble.core.declared import ArrayOf, check_arrays, read_declared
from hobble.core.errors import InputError
from hobble.core.files import DELETE_IT, Arrays, load_npz, map_npz, read_json, save_npz, write_json
from hobble.core.quat import Array
from hobble.core.section import Finite
from hobble.core.skeleton import skeleton_from_data
from hobble.rows.layout import (
    GAITS,
    RowLayout,
    body_layout,
    column_count_without_terrain,
    compose,
    frame_inputs,
    layout_from_data,
    lower_joints,
)

CHANNEL_PREFIX = "channel_"  # in a file, the name of each channel's array begins with it
VISITS = ArrayOf((), "iu", 1, 1000)
MOST_ROWS = 1 << 28  # of a clip
# Fields of `ClipRows` with a value for each row, and those with one for each terrain fit.
BY_ROW, BY_FIT = ("x", "y", "p", "frame", "cycle", "fits"), ("heights", "mean")


@dataclass(frozen=True)
class ClipRows:
    """R rows of a clip. Together they have S terrain fits.

    clip: name of the clip. layout: the columns of X and Y, with every channel of the data set. skeleton: see
    `Skeleton.to_dict`.
    x: (R, columns) X without terrain and channels. y: (R, columns) Y. Joint heights in x and y are measured
    from height 0 of the world. p: (R,) phase, 0 to 1. channels: channel -> values (R, columns).
    frame: (R,) int, frame of the clip. cycle: (R,) int, number of the cycle.
    fits: (R,) how many terrain fits each row has; their sum is S. heights: (S, 3 * samples) ground heights
    minus `mean`, cm. mean: (S,) mean height of the ground on the path, cm. To pair a row with a fit, subtract
    the fit's `mean` from the joint heights. `heights` and `mean` have the fits of row 0 first, then those of
    row 1, and so on.
    visits: how often a pass over the data uses each row. The number is the same for a row with fewer fits.
    """

    clip: str
    layout: RowLayout
    skeleton: Mapping[str, Any] = field(repr=False)
    x: Array = field(repr=False)
    y: Array = field(repr=False)
    p: Array = field(repr=False)
    channels: Mapping[str, Array] = field(repr=False)
    frame: np.ndarray = field(repr=False)
    cycle: np.ndarray = field(repr=False)
    fits: np.ndarray = field(repr=False)
    heights: Array = field(repr=False)
    mean: Array = field(repr=False)
    visits: int = 10

    def __len__(self) -> int:
        return len(self.p)

    @property
    def first_fit(self) -> np.ndarray:
        """(R,) index of each row's first fit in `heights` and `mean`."""
        return np.cumsum(self.fits) - self.fits

    def part(self, rows: slice) -> ClipRows:
        """The rows in a slice, with their fits."""
        kept = np.zeros(len(self), bool)
        kept[rows] = True
        kept_fits = np.repeat(kept, self.fits)
        by_row = {name: getattr(self, name)[kept] for name in BY_ROW}
        by_fit = {name: getattr(self, name)[kept_fits] for name in BY_FIT}
        channels = {name: values[kept] for name, values in self.channels.items()}
        return replace(self, **by_row, **by_fit, channels=channels)

    def check(self, where: str | Path) -> None:
        """Raise InputError if shapes do not match, a row has no fit, or a value is not finite.

        where: file or clip that the message names.
        """
        layout = self.layout
        if set(self.channels) != set(dict(layout.channels)):
            raise InputError(where, "its channels are not those that its layout names", fix=DELETE_IT)
        widths = {
            "x": column_count_without_terrain(body_layout(layout)),
            "y": layout.y_size,
            **dict(layout.channels),
        }
        by_row = {name: ArrayOf(("rows", width), finite=False) for name, width in widths.items()}
        by_row["p"] = ArrayOf(("rows",), low=0, high=1, finite=False)
        counts = {name: ArrayOf(("rows",), "iu", name == "fits") for name in ("frame", "cycle", "fits")}
        tables = {**vars(self), **self.channels}
        check_arrays(where, tables, by_row | counts, fix=DELETE_IT)
        for name in by_row:
            bad = ~np.isfinite(tables[name]).all(axis=tuple(range(1, tables[name].ndim)))
            if bad.any():
                frame = int(self.frame[np.argmax(bad)])
                raise InputError(where, f"{name} has a value that is not finite", frame=frame, fix=DELETE_IT)
        grounds = {"heights": ArrayOf(("fits", 3 * layout.samples)), "mean": ArrayOf(("fits",))}
        check_arrays(where, tables, grounds, {"fits": int(np.sum(self.fits))}, DELETE_IT)


class Pairs(NamedTuple):
    """n pairs of a row and one of its terrain fits. What Holden et al. (2017) call a row is such a pair.

    x: (n, X) and y: (n, Y), float32, with heights relative to the fit's `mean`. p: (n,) phase. row: (n,)
    index of the row. weight: (n,) 1 divided by the number of the row's fits, so that all pairs of a row
    together have weight 1.
    """

    x: Array
    y: Array
    p: Array
    row: np.ndarray
    weight: Array


def pair_batches(rows: ClipRows, layout: RowLayout, batch: int = 2048) -> Iterator[Pairs]:
    """Yield all pairs of a row and one of its fits, about `batch` at a time.

    Values are not standardised. layout: the layout of the rows, or one with fewer channels or without
    local phases.
    """
    first_fit = rows.first_fit
    start = 0
    while start < len(rows):
        stop = max(start + 1, int(np.searchsorted(first_fit, first_fit[start] + batch)))
        fits = rows.fits[start:stop]
        row = np.repeat(np.arange(start, stop), fits)
        yield compose_pairs(rows, layout, row, np.arange(first_fit[start], first_fit[stop - 1] + fits[-1]))
        start = stop


def compose_pairs(rows: ClipRows, layout: RowLayout, row: np.ndarray, fit: np.ndarray) -> Pairs:
    """The n pairs of row[i] and fit[i], not standardised.

    layout: see `pair_batches`. row: (n,) indices of rows. fit: (n,) indices of their fits in `rows.heights`.
    """
    x = np.empty((len(row), layout.x_size), np.float32)
    y = rows.y[row, : layout.y_size].astype(np.float32)
    values = {name: rows.channels[name][row] for name, _ in layout.channels}
    compose(layout, frame_inputs(layout, rows.x[row], values), rows.heights[fit], rows.mean[fit, None], x, y)
    return Pairs(x, y, rows.p[row], row, 1.0 / rows.fits[row])


def save_clip_rows(path: str | Path, rows: ClipRows) -> None:
    """Write rows as an npz file. Its values are float32, except for the integer arrays."""
    floats = {n: getattr(rows, n).astype(np.float32) for n in ("x", "y", "p", "heights", "mean")}
    floats |= {CHANNEL_PREFIX + name: values.astype(np.float32) for name, values in rows.channels.items()}
    integers = {n: getattr(rows, n).astype(np.int32) for n in ("frame", "cycle", "fits")}
    save_npz(
        path,
        clip=np.array(rows.clip),
        layout=np.array(json.dumps(rows.layout.to_dict(), sort_keys=True)),
        skeleton=np.array(json.dumps(rows.skeleton)),  # keys not sorted: joints have the order of the columns
        visits=np.array(rows.visits),
        **floats,
        **integers,
    )


class Outline(NamedTuple):
    """The few facts about a clip's rows that are needed before clips are merged. Fields as in `ClipRows`."""

    layout: RowLayout
    skeleton: Mapping[str, Any]
    fits: np.ndarray
    visits: int


def read_outline(source: ClipRows | str | Path) -> Outline:
    """The outline of `source`: rows, or the path of a file of rows.

    Of a file, only a few kilobytes are read. Raises InputError if it is not a file of rows.
    """
    if isinstance(source, ClipRows):
        return Outline(source.layout, source.skeleton, source.fits, source.visits)
    data = load_npz(source, ("layout", "skeleton", "fits", "visits"))
    layout, skeleton = _described(source, data)
    check_arrays(source, data, {"fits": ArrayOf(("rows",), "iu", 1)}, fix=DELETE_IT)
    return Outline(layout, skeleton, data["fits"], int(data["visits"]))


def _described(path: str | Path, data: Mapping[str, np.ndarray]) -> tuple[RowLayout, dict[str, Any]]:
    """Layout and skeleton of a file of rows. Raises InputError if one of them or `visits` is wrong."""
    texts = {name: ArrayOf((), "U") for name in ("layout", "skeleton")}
    check_arrays(path, data, {**texts, "visits": VISITS}, fix=DELETE_IT)
    skeleton_from_data(path, str(data["skeleton"]), fix=DELETE_IT)
    layout = layout_from_data(path, str(data["layout"]), DELETE_IT)
    return layout, json.loads(str(data["skeleton"]))


def load_clip_rows(path: str | Path, part: tuple[int, int] | None = None) -> ClipRows:
    """Read what `save_clip_rows` wrote. Raises InputError if the file is damaged or inconsistent.

    part: (first, stop), to read the rows from `first` up to `stop`, which is not included; None reads all
    rows. The file's checksums are checked only if all rows are read.
    """
    data = load_npz(path) if part is None else _read_part(path, *part)
    layout, skeleton = _described(path, data)
    keys = [key for key in data if key.startswith(CHANNEL_PREFIX)]
    rows = ClipRows(
        clip=str(data["clip"]),
        layout=layout,
        skeleton=skeleton,
        channels={key.removeprefix(CHANNEL_PREFIX): data[key] for key in keys},
        visits=int(data["visits"]),
        **{name: data[name] for name in (*BY_ROW, *BY_FIT)},
    )
    rows.check(path)
    return rows


def row_count(path: str | Path) -> int:
    """Number of rows in a file of rows. Does not read the rows."""
    return len(map_npz(path)["p"])


def _read_part(path: str | Path, first: int, stop: int) -> Arrays:
    """Read all arrays of a file, but only for the rows from `first` up to `stop`, which is not included."""
    file = map_npz(path)
    first_fit = int(file["fits"][:first].sum())  # number of fits of the rows before `first`
    rows = slice(first, stop)
    fits = slice(first_fit, first_fit + int(file["fits"][rows].sum()))
    parts: dict[str, Any] = {
        **dict.fromkeys(("clip", "layout", "skeleton", "visits"), ...),
        **dict.fromkeys(BY_FIT, fits),
    }
    return Arrays(path, [(name, np.array(array[parts.get(name, rows)])) for name, array in file.items()])


# Cuts clips into excerpts, from which a sample of a large data set is drawn.
#
# With excerpts, a long clip need not be read whole. A clip is cut into as few excerpts as possible, of about
# equal length. A short clip is one excerpt.


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
    def stop(self) -> int:
        """Index in the clip of the first row after the excerpt."""
        return self.first + self.rows


@dataclass(frozen=True)
class ExcerptKind:
    """What kind of motion is in an excerpt.

    gait: the gait with the largest mean share. speed: mean speed of the root, cm a frame. channels: names of
    the channels that have a value other than 0 in some row.
    """

    gait: Literal[GAITS]  # type: ignore[valid-type]
    speed: Finite
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
        problem = f"does not have as many rows as its summary says ({excerpt.clip_rows})"
        raise InputError(path, problem, fix=DELETE_IT)
    return rows


# A summary of a clip's rows, so that excerpts of the clip can be chosen before its rows are read.


@dataclass(frozen=True)
class RowsSummary:
    """A summary of a clip's rows.

    clip: name of the clip. rows: number of rows. kinds: what kind of motion is in each excerpt of the clip,
    in the order of `cut_into_excerpts`.
    """

    clip: str
    rows: Annotated[int, Field(ge=0, le=MOST_ROWS)]
    kinds: tuple[ExcerptKind, ...] = field(repr=False)

    @property
    def excerpts(self) -> dict[Excerpt, ExcerptKind]:
        """Each excerpt of the clip -> what kind of motion is in it."""
        return dict(zip(cut_into_excerpts(self.clip, self.rows), self.kinds, strict=True))


def summary_of_rows(rows: ClipRows) -> RowsSummary:
    """Make the summary of a clip's rows."""
    parts = cut_into_excerpts(rows.clip, len(rows))
    kinds = tuple(excerpt_kind(rows, part.first, part.stop) for part in parts)
    return RowsSummary(rows.clip, len(rows), kinds)


def save_summary(path: str | Path, summary: RowsSummary) -> None:
    """Write a summary as JSON."""
    write_json(Path(path), asdict(summary))


def load_summary(path: str | Path) -> RowsSummary:
    """Read what `save_summary` wrote. Raises InputError if the file holds something else."""
    summary = read_declared(path, "the summary", RowsSummary, read_json(Path(path)), DELETE_IT)
    if len(summary.kinds) != len(cut_into_excerpts(summary.clip, summary.rows)):
        raise InputError(path, "the summary has not one kind for each excerpt", fix=DELETE_IT)
    return summary


def shuffle_key(name: str) -> bytes:
    """A key for sorting names. The order looks random, but a new name does not change that of the others."""
    return hashlib.sha256(name.encode()).digest()


# Captured motion for the measurements: stretches of consecutive frames of a clip, in root coordinates.


@dataclass(frozen=True)
class Captured:
    """F consecutive frames of a clip.

    clip: its name. local: (F, J, 3) joint positions in root coordinates, heights above the ground, cm.
    contacts: (F, 4) 1 for contact with the ground, else 0, of left heel, left toe, right heel, right toe.
    phase: (F,) from 0 to 1. channels: name -> values (F, columns). gait: (F, 6) share of each of the GAITS.
    velocity: (F, 2) of the root in root coordinates, cm per frame. root: (F, 3) position of the root on the
    ground, cm. The first is the origin. acceleration: (F,) the largest of any joint, cm per frame squared, 0
    in the first frame. rows: (F,) index of each frame's row among the rows of the clip.
    """

    clip: str
    local: Array = field(repr=False)
    contacts: Array = field(repr=False)
    phase: Array = field(repr=False)
    channels: Mapping[str, Array] = field(repr=False)
    gait: Array = field(repr=False)
    velocity: Array = field(repr=False)
    root: Array = field(repr=False)
    acceleration: Array = field(repr=False)
    rows: np.ndarray = field(repr=False)

    def __len__(self) -> int:
        return len(self.phase)


def unbroken_stretches(frame: np.ndarray) -> list[np.ndarray]:
    """For each stretch of consecutive frames, the indices of its rows. frame: (R,) frame of each row.

    A frame on the border of two gait cycles has two rows, one in each cycle. Only the first of them is taken.

    >>> [stretch.tolist() for stretch in unbroken_stretches(np.array([3, 4, 7, 8, 8, 9]))]
    [[0, 1], [2, 3, 5]]
    """
    if not len(frame):
        return []
    _, first = np.unique(frame, return_index=True)
    return np.split(first, np.flatnonzero(np.diff(frame[first]) != 1) + 1)


def captured_stretches(rows: ClipRows) -> Iterator[Captured]:
    """Each stretch of consecutive frames in a clip's rows.

    A row has several terrain fits (ground heights that suit the motion). Joint heights are measured from the
    mean ground height of its first fit.
    """
    layout = rows.layout
    for chosen in unbroken_stretches(rows.frame):  # indices of rows
        y = rows.y[chosen].astype(float)
        lower_joints(y, layout.y_joint_position, rows.mean[rows.first_fit[chosen]][:, None])
        local = y[:, layout.y_joint_position].reshape(len(chosen), -1, 3)
        turn, velocity = y[:, layout.y_turn][:, 0], y[:, layout.y_root_velocity]
        gait = rows.x[chosen][:, layout.x_gait].reshape(len(chosen), len(GAITS), layout.samples)
        yield Captured(
            rows.clip,
            local,
            y[:, layout.y_contacts],
            rows.p[chosen].astype(float),
            {name: values[chosen].astype(float) for name, values in rows.channels.items()},
            gait[:, :, layout.samples // 2].astype(float),
            velocity,
            root_path(velocity, turn),
            _accelerations(y[:, layout.y_joint_velocity].reshape(local.shape), turn),
            chosen,
        )


def headings(turn: Array) -> Array:
    """(F,) yaw of a root in radians. It starts at 0.

    turn: (F,) column `y_turn` of Y, radians a frame: by how much the world turns, seen from the root. The
    root itself turns by the negative.
    """
    return np.concatenate([[0.0], -np.cumsum(turn)[:-1]])


def root_path(velocity: Array, turn: Array) -> Array:
    """(F, 3) positions of a root, cm. The path starts at the origin, and its height is 0.

    velocity: (F, 2) of the root in root coordinates, cm per frame. turn: (F,) as for `headings`.
    """
    world_velocity = rotate_by_yaw(velocity, headings(turn))
    out = np.zeros((len(turn), 3))
    out[1:, ::2] = np.cumsum(world_velocity, axis=0)[:-1]
    return out


def rotate_by_yaw(vectors: Array, yaw: Array) -> Array:
    """Rotate horizontal vectors x, z (..., 2) from root coordinates to the world. yaw: (...) of the root."""
    sin, cos = np.sin(yaw), np.cos(yaw)
    x, z = vectors[..., 0], vectors[..., 1]
    return np.stack([x * cos + z * sin, z * cos - x * sin], axis=-1)


def _accelerations(velocity: Array, turn: Array) -> Array:
    """(F,) largest change of any joint's velocity since the frame before, cm per frame squared.

    velocity: (F, J, 3) in the root coordinates of each frame. turn: (F,) as for `headings`.
    """
    before = velocity[:-1].copy()  # becomes each frame's velocity in the root coordinates of the next frame
    before[..., ::2] = rotate_by_yaw(velocity[:-1, :, ::2], turn[:-1, None])
    change = np.linalg.norm(velocity[1:] - before, axis=-1)
    return np.concatenate([[0.0], change.max(axis=1)]) if len(velocity) else np.zeros(0)
