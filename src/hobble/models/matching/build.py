"""Builds the tables that motion matching searches and plays, from the rows of the clips.

A row of a clip's file holds the inputs x and the outputs y of a network in one frame. A frame in which one
gait cycle ends and the next begins has a row for each. Motion matching searches for the row with the nearest
x, and shows its y.

After Holden, Kanoun, Perepichka, Popa, Learned Motion Matching (2020), section 3, the features that a search
compares are path positions and facing directions at one third, two thirds and the end of the trajectory
ahead, position and velocity of both feet, and velocity of the hips. Hobble adds the gait, the ground heights
ahead and the channel values.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hobble.channels import channel
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.models.model import FinishedNetwork
from hobble.rows.clip_rows import ClipRows, load_clip_rows
from hobble.rows.layout import GAITS, RowLayout, compose, frame_inputs

FEET = ("left_heel", "right_heel")  # the joints of the skeleton with these roles
# A run is a sequence of consecutive frames of a clip. A search skips rows with fewer frames left in their
# run, because playback would soon reach its end.
FEWEST_LEFT = 20
LEAST_SPREAD = 1e-6  # a group of columns with a smaller mean standard deviation gets weight 0


# The fields of `hobble.models.matching.MatchingOptions`, whose module imports this one.
SearchOptions = Any


def build(
    options: SearchOptions, clips: Sequence[str | Path], layout: RowLayout, skeleton: Skeleton
) -> FinishedNetwork:
    """Motion matching over the frames of clips; see `read_tables`."""
    tables = read_tables(options, clips, layout, skeleton)
    words = f"{len(tables['frames']):,} frames of clips, compared by {len(tables['columns'])} features"
    meta = {"every": options.every, "halflife": options.halflife}
    return FinishedNetwork("matching", tables, words, meta)


def read_tables(
    options: SearchOptions, clips: Sequence[str | Path], layout: RowLayout, skeleton: Skeleton
) -> dict[str, Array]:
    """The arrays of the network's file: R frames of clips, in runs of consecutive frames of one clip.

    features: (R, n) float32, the columns of x that a search compares, each times its weight. frames: (R, Y)
    float32, raw units. phase: (R,) in cycles. remaining: (R,) int32, how many frames of the run follow.
    columns: (n,) which columns of x are features. feature_weights: (n,) their weights.

    clips: the files with the rows of the clips. layout: the columns of x and y, with the channels of
    the network; other channels of the clips are left out. skeleton: the one to which the layout belongs.
    Raises InputError if a file is not a file of rows or has another layout, or if no file has a frame.
    """
    parts = []
    for path in clips:
        rows = load_clip_rows(path)
        if not rows.layout.serves(layout):
            raise InputError(path, f"its columns ({rows.layout}) do not fit the database ({layout})")
        kept, remaining = find_runs(rows)
        x, y = on_mean_ground(rows, layout)
        parts.append((x[kept], y[kept], rows.p[kept], remaining))
    if not sum(len(part[0]) for part in parts):
        raise InputError("the clips", "hold no frame to match", fix="Train on a clip with a whole cycle.")
    x, frames, phase, remaining = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    columns, weights = columns_and_weights(layout, skeleton, options, x)
    return {
        "features": np.ascontiguousarray(x[:, columns] * weights, np.float32),
        "frames": frames,
        "phase": phase.astype(np.float32) % 1.0,
        "remaining": remaining,
        "columns": columns,
        "feature_weights": weights,
    }


def on_mean_ground(rows: ClipRows, layout: RowLayout) -> tuple[Array, Array]:
    """x (R, X) and y (R, Y) of the rows, float32, raw units.

    A row has several terrain fits, that is, grounds that suit its motion. The x and y returned describe the
    figure on the mean of these grounds.
    """
    x = np.empty((len(rows), layout.x_size), np.float32)
    y = rows.y[:, : layout.y_size].astype(np.float32)
    if not len(rows):
        return x, y
    count = rows.fits[:, None]
    # Means over the fits of each row. `rows.mean` is a fit's mean ground height, and `rows.heights` are its
    # ground heights relative to this.
    ground = np.add.reduceat(rows.heights, rows.first_fit, axis=0) / count
    mean_height = np.add.reduceat(rows.mean, rows.first_fit)[:, None] / count
    values = {name: rows.channels[name] for name, _ in layout.channels}
    # Fills x, and makes the joint heights in x and y relative to the mean ground, both in place.
    compose(layout, frame_inputs(layout, rows.x, values), ground, mean_height, x, y)
    return x, y


def find_runs(rows: ClipRows) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """The indices (R',) of the rows to keep, and how many frames follow each kept row in its run (R',).

    A run is a sequence of consecutive frames. Each frame is kept once: adjacent cycles share a frame, which
    has two rows in the file. The later row is kept, because the next cycle begins with it.
    """
    frame = rows.frame
    kept = np.flatnonzero(np.diff(frame, append=-1) != 0)
    frame = frame[kept]
    # A run ends at a row if the next row's frame number is not one higher, and at the last row (hence + 2).
    ends = np.flatnonzero(np.diff(frame, append=frame[-1] + 2 if len(frame) else 0) != 1)
    index = np.arange(len(kept))
    return kept, (ends[np.searchsorted(ends, index)] - index).astype(np.int32)


def findable_rows(remaining: NDArray[Any]) -> NDArray[np.int64]:
    """Indices (S,) of the rows that a search may find. remaining: (R,) as in `read_tables`.

    These rows are not near the end of a run (FEWEST_LEFT), and not the first of a run: rotation speeds are
    computed from the row before. If all runs are too short, a search may find all rows but the first of each
    run. If every run has only one row, it may find all rows.
    """
    is_first = np.r_[True, remaining[:-1] == 0]
    far_from_end = np.flatnonzero((remaining >= FEWEST_LEFT) & ~is_first)
    if len(far_from_end):
        return far_from_end
    return np.flatnonzero(~is_first) if (~is_first).any() else np.arange(len(is_first))


def feature_groups(
    layout: RowLayout, skeleton: Skeleton, options: SearchOptions
) -> list[tuple[str, list[int], float]]:
    """(name, columns of X, weight) of each group of features. All columns of a group get the same factor."""
    samples, now = layout.samples, layout.samples // 2  # now: index of the trajectory sample at the present
    ahead = sorted({now + max(0, round(layout.future * third / 3) - 1) for third in (1, 2, 3)})
    positions, velocities = layout.x_joint_position, layout.x_joint_velocity

    def columns_ahead(block: slice) -> list[int]:
        return [block.start + axis * samples + sample for axis in range(2) for sample in ahead]

    def joint_columns(block: slice, role: str) -> list[int]:
        return [block.start + 3 * skeleton.role(role) + axis for axis in range(3)]

    groups = [
        ("path", columns_ahead(layout.x_position), options.path),
        ("facing", columns_ahead(layout.x_direction), options.facing),
        *((f"{foot} position", joint_columns(positions, foot), options.foot_position) for foot in FEET),
        *((f"{foot} velocity", joint_columns(velocities, foot), options.foot_velocity) for foot in FEET),
        ("hips velocity", joint_columns(velocities, "hips"), options.hip_velocity),
        ("gait", [layout.x_gait.start + gait * samples + now for gait in range(len(GAITS))], options.gait),
        # The heights left of the path come first, then those on it.
        ("ground", [layout.x_terrain.start + samples + sample for sample in ahead], options.ground),
    ]
    blocks = {name: layout.x_channel(name) for name, _ in layout.channels}
    return groups + [(n, list(range(b.start, b.stop)), options.channels) for n, b in blocks.items()]


def columns_and_weights(
    layout: RowLayout, skeleton: Skeleton, options: SearchOptions, x: Array
) -> tuple[NDArray[np.int64], Array]:
    """Columns of X (n,) and their factors (n,) float32, with which features of different units are compared.

    x: (R, X) the inputs of all frames, in raw units. The factor of a group is its weight divided by the mean
    standard deviation of its columns, as in the paper. With a deviation for each column, columns that hardly
    vary would be amplified. The weight of a channel is divided by the channel's highest value instead, so
    that the factor does not depend on how many frames have a value above 0.
    """
    columns: list[int] = []
    weights: list[Array] = []
    for name, group, weight in feature_groups(layout, skeleton, options):
        if name in dict(layout.channels):
            spread = channel(name).highest
        else:
            spread = float(x[:, group].std(axis=0, dtype=np.float64).mean())
        columns += group
        weights.append(np.full(len(group), weight / spread if spread > LEAST_SPREAD else 0.0, np.float32))
    return np.array(columns, np.int64), np.concatenate(weights)
