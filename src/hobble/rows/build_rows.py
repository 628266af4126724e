"""Rows for one clip: input X, output Y and phase P of the network, for each frame of the clip's cycles.

Columns and root frames are those of the pipeline that Holden, Komura, Saito (2017) released.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from hobble.channels import channel
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.motion.root import RootFrames, continued, local_pose, points_to_root, root_frames, vectors_to_root
from hobble.rows.clip_rows import ClipRows
from hobble.rows.layout import RowLayout

Arrays = Mapping[str, np.ndarray]


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
    """The rows of a clip's locomotion cycles, one cycle after another. See `ClipRows` for their form.

    labels, terrain: arrays of these stages (`Labels`, `ClipFits`). channels: name -> values (F, columns).
    window: frames of the trajectory before and after the row's frame. step: frames between two samples of the
    trajectory. facing_sigma: sigma of the Gaussian that smooths the facing direction, frames. Past the ends
    of the clip the root moves on (`continued`), and the gait of the first or the last frame is repeated.
    Raises InputError if the files do not belong together, or if the clip has no frame before or after a
    cycle.
    """
    skeleton = clip.skeleton
    columns = tuple((name, values.shape[1]) for name, values in channels.items())
    layout = RowLayout(len(skeleton.joints), window, step, columns)
    frame, cycle = cycle_frames(labels["cycles"])
    _check(name, clip, labels, channels, terrain, frame)
    root = root_frames(clip, facing_sigma)
    path, here = continued(root, window), frame + window
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
    """The parts of X (without the ground) and of Y in the rows of the frames `frame` (R,), in their order.

    path: the root that moves on past the ends of the clip, and the places (R,) of the frames on it. pose: of
    all frames, in the root frame, see `local_pose`.
    """
    going, here = path
    position, velocity, rotation = pose
    x = [
        *trajectory(going, here, here, layout.offsets),
        gait_columns(labels["gait"], frame, layout.offsets),
        position[frame - 1],
        velocity[frame - 1],
    ]
    y = [
        velocity[frame, hips][:, [0, 2]],
        root.turn[frame],
        phase_change(labels["phase"])[frame],
        labels["contacts"][frame],
        *trajectory(going, here + 1, here + 1, layout.offsets[layout.future :]),
        position[frame],
        velocity[frame],
        rotation[frame],
    ]
    return x, y


def cycle_frames(cycles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frame (R,) and cycle number (R,) of each row. cycles: (C, 2) first and last frame of each cycle.

    Both ends belong to a cycle. So the frame in which one cycle ends and the next begins has two rows.

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
    """(F - 1,) change of phase (F,) from each frame to the next, plus 1 where a new cycle begins."""
    change = np.diff(phase.astype(float))
    return np.where(change < 0, change + 1, change)


def trajectory(root: RootFrames, frame: np.ndarray, seen_from: np.ndarray, offsets: range) -> list[Array]:
    """Root positions and directions at `frame` + offsets, in the root coordinates of `seen_from`.

    frame, seen_from: (R,) frame numbers. Returns four arrays (R, samples): position x and z (cm), direction x
    and z.
    """
    at = frame[:, None] + np.array(offsets)
    ground = np.zeros((*at.shape, 3))
    ground[..., [0, 2]] = root.position[at]
    position = points_to_root(root, ground, seen_from)
    direction = vectors_to_root(root, root.direction[at], seen_from)
    return [position[..., 0], position[..., 2], direction[..., 0], direction[..., 2]]


def gait_columns(gait: Array, frame: np.ndarray, offsets: range) -> Array:
    """(R, gaits, samples) share of each gait at `frame` + offsets.

    frame: (R,) frame numbers. gait: (F, gaits); its first and last frame are repeated past the ends.
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
    lengths = {"labels": len(labels["phase"]), **{name: len(values) for name, values in channels.items()}}
    for what, length in lengths.items():
        if length != len(clip):
            raise InputError(where, f"{what} have {length} frames, the clip has {len(clip)}")
    for channel_name, values in channels.items():
        columns = len(channel(channel_name).columns(clip.skeleton))
        if values.shape[1] != columns:
            problem = f"{channel_name} has {values.shape[1]} columns where the skeleton needs {columns}"
            raise InputError(where, problem)
    if not np.array_equal(terrain["frame"], frame):
        raise InputError(
            where,
            "terrain was fitted to other cycles than those of the labels",
            fix="Make both again from the same clip.",
        )
    if len(frame) and (frame.min() < 1 or frame.max() + 2 > len(clip)):
        outside = int(frame.min() if frame.min() < 1 else frame.max())
        raise InputError(where, "the clip has no frame before or after a cycle", frame=outside)
