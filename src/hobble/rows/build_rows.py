"""Rows for one clip: input X, output Y and phase P of the network, for each frame of the clip's cycles.

The columns, and the coordinate system that moves with the root, are those of the pipeline that Holden,
Komura, Saito (2017) released.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hobble.channels import channel
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.motion.root import (
    RootFrames,
    extend_root,
    local_pose,
    points_to_root,
    root_frames,
    vectors_to_root,
)
from hobble.rows.clip_rows import ClipRows
from hobble.rows.layout import RowLayout

Arrays = Mapping[str, np.ndarray]

MAKE_AGAIN = "Make the clip's labels, channels and terrain again."


def clip_rows(
    name: str,
    clip: Clip,
    labels: Arrays,
    channels: Arrays,
    terrain: Arrays,
    *,
    window: int,
    step: int,
    facing_sigma: float,
) -> ClipRows:
    """The rows of a clip's locomotion cycles, one cycle after another.

    name: of the clip. labels, terrain: the arrays that the stages of these names saved for the clip.
    channels: name -> values (F, columns).
    window: frames of the trajectory before and after the row's frame. step: frames between two samples of the
    trajectory. facing_sigma: sigma of the Gaussian that smooths the facing direction, frames.
    Past the ends of the clip the root moves straight on, and the gait of the first or the last frame is
    repeated.
    Raises InputError if labels, channels or terrain do not fit the clip, or if the clip has no frame before
    or after a cycle.
    """
    skeleton = clip.skeleton
    columns = tuple((name, values.shape[1]) for name, values in channels.items())
    layout = RowLayout(len(skeleton.joints), window, step, columns)
    frame, cycle = cycle_frames(labels["cycles"])
    _check(name, clip, labels, channels, terrain, frame)
    root = root_frames(clip, facing_sigma)
    path, here = extend_root(root, window), frame + window
    x, y = _columns(labels, layout, frame, (path, here), root, local_pose(clip, root), skeleton.role("hips"))
    centre = terrain["heights"][:, layout.samples : 2 * layout.samples]
    mean = centre.mean(axis=1, dtype=np.float64)
    return ClipRows(
        clip=name,
        layout=layout,
        skeleton=skeleton.to_dict(),
        x=_table(x, len(frame)),
        y=_table(y, len(frame)),
        p=cycle_phase(labels["phase"], labels["cycles"]),
        channels={name: values[frame] for name, values in channels.items()},
        frame=frame,
        cycle=cycle,
        fits=terrain["fits"],
        heights=terrain["heights"] - mean[:, None],
        mean=mean,
        visits=terrain["patch"].shape[1],
    )


def _columns(
    labels: Arrays,
    layout: RowLayout,
    frame: np.ndarray,
    path: tuple[RootFrames, np.ndarray],
    root: RootFrames,
    pose: tuple[Array, Array, Array],
    hips: int,
) -> tuple[list[Array], list[Array]]:
    """The blocks of X (without terrain and channels) and of Y, in column order, for R rows.

    frame: (R,) the clip's frame of each row. path: the root with more frames before and after the clip, and
    the index (R,) in it of each row's frame. root: the root in the clip alone. pose: joint positions,
    velocities and rotations in root coordinates, in all frames but the last. hips: index of this joint.
    """
    longer_root, here = path
    position, velocity, rotation = pose
    x = [
        *trajectory(longer_root, here, here, layout.offsets),
        gait_columns(labels["gait"], frame, layout.offsets),
        position[frame - 1],
        velocity[frame - 1],
    ]
    y = [
        velocity[frame, hips][:, [0, 2]],
        root.turn[frame],
        phase_change(labels["phase"])[frame],
        labels["contacts"][frame],
        *trajectory(longer_root, here + 1, here + 1, layout.offsets[layout.future :]),
        position[frame],
        velocity[frame],
        rotation[frame],
    ]
    return x, y


def cycle_frames(cycles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frame (R,) and cycle number (R,) of each row. cycles: (C, 2) first and last frame of each cycle.

    The first and the last frame both belong to the cycle. So a frame in which one cycle ends and the next
    begins has two rows.

    >>> cycle_frames(np.array([[60, 62], [62, 63]]))
    (array([60, 61, 62, 62, 63]), array([0, 0, 0, 1, 1]))
    """
    lengths = cycles[:, 1] - cycles[:, 0] + 1
    cycle = np.repeat(np.arange(len(cycles)), lengths)
    within = np.arange(len(cycle)) - np.repeat(np.cumsum(lengths) - lengths, lengths)
    return np.repeat(cycles[:, 0], lengths) + within, cycle


def cycle_phase(phase: Array, cycles: np.ndarray) -> Array:
    """Phase (R,) of the rows of the cycles, exactly 0 in the first row of a cycle and 1 in the last."""
    frame, cycle = cycle_frames(cycles)
    out = phase[frame].astype(float)
    out[frame == cycles[cycle, 0]] = 0.0
    out[frame == cycles[cycle, 1]] = 1.0
    return out


def phase_change(phase: Array) -> Array:
    """(F - 1,) change of `phase` (F,) from each frame to the next. Where the phase restarts, 1 is added."""
    change = np.diff(phase.astype(float))
    return np.where(change < 0, change + 1, change)


def trajectory(root: RootFrames, frame: np.ndarray, seen_from: np.ndarray, offsets: range) -> list[Array]:
    """Positions and facing directions of the root, sampled at `offsets` from each of R frames.

    frame: (R,) numbers of these frames. seen_from: (R,) for each of them, the number of the frame in whose
    root coordinates the result is given. Returns four arrays (R, samples): position x and z (cm), direction x
    and z.
    """
    at = frame[:, None] + np.array(offsets)
    ground = np.zeros((*at.shape, 3))
    ground[..., [0, 2]] = root.position[at]
    position = points_to_root(root, ground, seen_from)
    direction = vectors_to_root(root, root.direction[at], seen_from)
    return [position[..., 0], position[..., 2], direction[..., 0], direction[..., 2]]


def gait_columns(gait: Array, frame: np.ndarray, offsets: range) -> Array:
    """(R, gaits, samples) share of each gait, at each of `offsets` from each frame.

    gait: (F, gaits) shares in the clip; past its ends, the first and the last are repeated. frame: (R,)
    numbers of the frames.
    """
    at = np.clip(frame[:, None] + np.array(offsets), 0, len(gait) - 1)
    return np.swapaxes(gait[at], 1, 2)


def _table(columns: list[Array], rows: int) -> Array:
    flat = [
        np.asarray(c, np.float32).reshape(rows, -1 if rows else int(np.prod(c.shape[1:]))) for c in columns
    ]
    return np.concatenate(flat, axis=1)


def _check(
    name: str,
    clip: Clip,
    labels: Arrays,
    channels: Arrays,
    terrain: Arrays,
    frame: np.ndarray,
) -> None:
    where = name
    lengths = {"labels": len(labels["phase"])}
    lengths |= {f"values of {name}": len(values) for name, values in channels.items()}
    for what, length in lengths.items():
        if length != len(clip):
            raise InputError(where, f"{what} have {length} frames, the clip has {len(clip)}", fix=MAKE_AGAIN)
    for channel_name, values in channels.items():
        columns = len(channel(channel_name).columns(clip.skeleton))
        if values.shape[1] != columns:
            problem = f"{channel_name} has {values.shape[1]} columns where the skeleton needs {columns}"
            raise InputError(where, problem, fix=MAKE_AGAIN)
    if not np.array_equal(terrain["frame"], frame):
        raise InputError(
            where,
            "terrain was fitted to other cycles than those of the labels",
            fix=MAKE_AGAIN,
        )
    if len(frame) and (frame.min() < 1 or frame.max() + 2 > len(clip)):
        outside = int(frame.min() if frame.min() < 1 else frame.max())
        raise InputError(where, "the clip has no frame before or after a cycle", frame=outside)
