"""Builds the rows of one clip. A row is input X, output Y and phase P of the network for one frame.

Only the frames of the clip's gait cycles have rows.

The columns, and the coordinate system that moves with the root, are those of the pipeline that Holden,
Komura, Saito (2017) released.
"""

from collections.abc import Mapping

import numpy as np

from hobble.channels import channel
from hobble.core.clip import Clip
from hobble.core.declared import ArrayOf, check_arrays
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.labels.local_phase import PARTS
from hobble.motion.root import (
    RootFrames,
    extend_root,
    local_pose,
    points_to_root,
    root_frames,
    vectors_to_root,
)
from hobble.rows.clip_rows import ClipRows
from hobble.rows.layout import CONTACTS, GAITS, RowLayout
from hobble.terrain.clip_fits import cycle_frames

Arrays = Mapping[str, np.ndarray]

MAKE_AGAIN = "Make the clip's labels, channels and terrain again."


def build_clip_rows(
    name: str,
    clip: Clip,
    labels: Arrays,
    channels: Arrays,
    terrain: Arrays,
    *,
    window: int,
    step: int,
    facing_sigma: float,
    local_phases: tuple[Array, Array] | None = None,
) -> ClipRows:
    """Build the rows of a clip's gait cycles, one cycle after another.

    name: name of the clip. labels: the arrays of `hobble.labels.clip_labels.Labels`. channels: channel ->
    values (F, columns). terrain: the arrays of `hobble.terrain.clip_fits.ClipFits`. window: frames of the
    trajectory before and after the row's frame. step: frames between two samples of the trajectory.
    facing_sigma: sigma of the Gaussian that smooths the facing direction, frames. local_phases: as
    `hobble.labels.local_phase.local_phases` returns them; None for rows without them.
    The trajectory may reach past the ends of the clip. There the root moves straight on, and the gait of the
    first or the last frame is repeated.
    Raises InputError if labels, channels or terrain do not fit the clip, or if the clip has no frame before
    or after a cycle.
    """
    skeleton = clip.skeleton
    columns = tuple((name, values.shape[1]) for name, values in channels.items())
    layout = RowLayout(
        len(skeleton.joints), window, step, columns, local_phases=len(PARTS) if local_phases else 0
    )
    frame, cycle = cycle_frames(labels["cycles"])
    _check(name, clip, labels, channels, terrain, frame)
    x, y = _body_columns(clip, labels, layout, frame, root_frames(clip, facing_sigma), local_phases)
    # Ground heights come in three groups, left of the path, on it and right of it. Each has all samples.
    heights_on_path = terrain["heights"][:, layout.samples : 2 * layout.samples]
    mean = heights_on_path.mean(axis=1, dtype=np.float64)
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
        visits=terrain["patch"].shape[1],  # the number of fits that was asked for
    )


def _body_columns(
    clip: Clip,
    labels: Arrays,
    layout: RowLayout,
    frame: np.ndarray,
    root: RootFrames,
    local_phases: tuple[Array, Array] | None,
) -> tuple[list[Array], list[Array]]:
    """The blocks of X without terrain and channels, and the blocks of Y, both in column order.

    A block has one entry for each of the R rows. frame: (R,) the frame of the clip for each row.
    """
    # The root continued past the ends of the clip, and the index of each row's frame in it.
    longer_root, frame_in_longer = extend_root(root, layout.window), frame + layout.window
    position, velocity, rotation = local_pose(clip, root)
    x = [
        *trajectory(longer_root, frame_in_longer, layout.offsets),
        gait_columns(labels["gait"], frame, layout.offsets),
        position[frame - 1],
        velocity[frame - 1],
    ]
    y = [
        velocity[frame, clip.skeleton.role("hips")][:, [0, 2]],
        root.turn[frame],
        phase_change(labels["phase"])[frame],
        labels["contacts"][frame],
        *trajectory(longer_root, frame_in_longer + 1, layout.offsets[layout.future :]),
        position[frame],
        velocity[frame],
        rotation[frame],
    ]
    if local_phases:
        vectors, change = local_phases
        x += [vectors[frame], rotation[frame - 1]]
        y += [vectors[frame + 1], change[frame]]
    return x, y


def cycle_phase(phase: Array, cycles: np.ndarray) -> Array:
    """Phase (R,) of each row: exactly 0 in the first row of a cycle and exactly 1 in the last.

    phase: (F,) phase in the clip, from 0 to 1. cycles: see `cycle_frames`.
    """
    frame, cycle = cycle_frames(cycles)
    out = phase[frame].astype(float)
    out[frame == cycles[cycle, 0]] = 0.0
    out[frame == cycles[cycle, 1]] = 1.0
    return out


def phase_change(phase: Array) -> Array:
    """Change of `phase` (F,) from each frame to the next (F - 1,), in cycles.

    Where the phase falls, a new cycle begins. There 1 is added, so that the change is never negative.
    """
    change = np.diff(phase.astype(float))
    return np.where(change < 0, change + 1, change)


def trajectory(root: RootFrames, frame: np.ndarray, offsets: range) -> list[Array]:
    """Positions and facing directions of the root around each of R frames, in its root coordinates.

    frame: (R,) these frames. offsets: frames from each of them to the samples. Returns four arrays
    (R, samples): x and z of the position (cm), then x and z of the facing direction.
    """
    sampled = frame[:, None] + np.array(offsets)
    on_ground = np.zeros((*sampled.shape, 3))
    on_ground[..., [0, 2]] = root.position[sampled]
    position = points_to_root(root, on_ground, frame)
    direction = vectors_to_root(root, root.direction[sampled], frame)
    return [position[..., 0], position[..., 2], direction[..., 0], direction[..., 2]]


def gait_columns(gait: Array, frame: np.ndarray, offsets: range) -> Array:
    """The shares of the gaits around each of R frames, (R, gaits, samples).

    gait: (F, gaits) shares in the clip. Past the ends of the clip, the shares in its first or last frame are
    repeated. frame: (R,) these frames. offsets: frames from each of them to the samples.
    """
    sampled = np.clip(frame[:, None] + np.array(offsets), 0, len(gait) - 1)
    return np.swapaxes(gait[sampled], 1, 2)


def _table(blocks: list[Array], rows: int) -> Array:
    """One float32 table (rows, columns) of blocks (rows, ...), side by side."""
    flat = [
        # With 0 rows, numpy cannot find out the number of columns, so that -1 is an error.
        np.asarray(block, np.float32).reshape(rows, -1 if rows else int(np.prod(block.shape[1:])))
        for block in blocks
    ]
    return np.concatenate(flat, axis=1)


def _check(
    name: str, clip: Clip, labels: Arrays, channels: Arrays, terrain: Arrays, frame: np.ndarray
) -> None:
    """Raise InputError if the arguments of `build_clip_rows` do not match. frame: (R,) frames of the rows."""
    frames = "frames of the clip"
    declared = {
        "phase": ArrayOf((frames,), low=0, high=1),
        "gait": ArrayOf((frames, len(GAITS)), low=-1e-3, high=1.001),
        "contacts": ArrayOf((frames, len(CONTACTS)), "biuf", 0, 1),
    }
    for each in channels:
        columns = channel(each).columns(clip.skeleton)
        declared[each] = ArrayOf((frames, len(columns)), high=channel(each).highest)
    check_arrays(name, {**labels, **channels}, declared, {frames: len(clip)}, MAKE_AGAIN)
    if not np.array_equal(terrain["frame"], frame):
        problem = "its terrain was fitted to other cycles than its labels have now"
        raise InputError(name, problem, fix=MAKE_AGAIN)
    # A row needs the pose of the frame before it, and the velocity to the frame after it.
    if len(frame) and (frame.min() < 1 or frame.max() + 2 > len(clip)):
        outside = int(frame.min() if frame.min() < 1 else frame.max())
        fix = "Leave out this cycle, or use a clip that is longer at this end."
        raise InputError(name, "the clip has no frame before or after a cycle", frame=outside, fix=fix)
