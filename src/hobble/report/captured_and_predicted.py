"""Packs captured motion, and the network's prediction of each of its frames, for the report page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.array_parts import ArrayParts
from hobble.core.quat import Array
from hobble.evaluation.captured import headings, root_path, rotate_by_yaw, unbroken_stretches
from hobble.figure.mesh import body_mesh, mesh_key
from hobble.models.network import Network
from hobble.report.scenes import FPS, UNIT, packed_motion
from hobble.rows.clip_rows import ClipRows, compose_pairs, load_clip_rows

FEWEST_CLIPS = 6  # if fewer clips are held out, training clips are added up to this number
MOST_HELD_OUT = 16  # at most this many held-out clips are shown; each takes up to 230 kB of the page
LONGEST = 12 * 60  # at most this many frames of a clip are shown: 12 seconds


def packed_comparisons(
    network: Network, paths: Iterable[str | Path], splits: Mapping[str, str]
) -> dict[str, Any]:
    """The longest stretch of consecutive frames of each shown clip, captured and predicted.

    paths: `database/clips/<clip>.npz`. splits: clip -> "held_out" or "train". At most MOST_HELD_OUT held-out
    clips are shown. If fewer than FEWEST_CLIPS are held out, training clips are added. Each pose is predicted
    from the captured input of the frame before. The ground is the first terrain fit of the frame: fits are
    ground heights that suit the motion. Both motions are drawn at the captured root.

    Keys of the result: `fps`; `unit`, cm for a step of the packed positions; `joints`, the number of joints
    that are drawn; `body`, the key of the body's mesh; `clips`, one `_compared_clip` each. It is {} if there
    is no clip to show or the network has no skeleton.
    """
    if network.skeleton is None:
        return {}
    drawn_joints = body_mesh(network.skeleton).bones.tolist()
    order = sorted(paths, key=lambda path: (splits.get(Path(path).stem) != "held_out", Path(path).stem))
    clips = []
    held_out = sum(splits.get(Path(path).stem) == "held_out" for path in order)
    # Take clips from all over the list: neighbours in it are often takes of the same motion.
    for path in order[: max(FEWEST_CLIPS, held_out)][:: max(1, -(-held_out // MOST_HELD_OUT))]:
        rows = load_clip_rows(path, longest_stretch(path))
        if rows.layout.joints == network.layout.joints and len(rows):
            clips.append(_compared_clip(network, rows, splits.get(rows.clip, "train"), drawn_joints))
    if not clips:
        return {}
    mesh = mesh_key(network.skeleton)
    return {"fps": FPS, "unit": UNIT, "joints": len(drawn_joints), "body": mesh, "clips": clips}


def longest_stretch(path: str | Path) -> tuple[int, int]:
    """First row of a clip's longest stretch of consecutive frames, and the row after its last.

    The stretch is cut to LONGEST frames. Both numbers are 0 if the clip has no rows.
    """
    stretches = unbroken_stretches(ArrayParts(path).read_whole("frame"))
    if not stretches:
        return 0, 0
    longest = max(stretches, key=len)[:LONGEST]
    return int(longest[0]), int(longest[-1]) + 1


def _compared_clip(network: Network, rows: ClipRows, split: str, drawn_joints: list[int]) -> dict[str, Any]:
    """The data of one clip for the page.

    rows: consecutive frames of the clip. Keys of the result: `name` of the clip; `split`; `frames`, their
    number; `captured` and `predicted`, from `packed_motion`; `error`, for each frame the mean distance from
    predicted to captured joints, cm.
    """
    (chosen,) = unbroken_stretches(rows.frame)  # indices of the rows, only one for each frame
    layout, figure = network.layout, network.skeleton
    assert figure is not None
    pose = slice(layout.y_joint_position.start, layout.y_joint_rotation.stop)
    samples = compose_pairs(rows, layout, chosen, rows.first_fit[chosen])
    outputs = (samples.y, network.predict(samples.x, samples.p))
    # Captured and predicted, each an array (F, 3, J, 3): position, velocity and rotation of each joint.
    poses = [y[:, pose].astype(float).reshape(len(chosen), 3, -1, 3) for y in outputs]
    error = np.linalg.norm(poses[0][:, 0] - poses[1][:, 0], axis=-1).mean(axis=1)
    ground = rows.mean[rows.first_fit[chosen]][:, None]
    y = rows.y[chosen].astype(float)
    turn = y[:, layout.y_turn][:, 0]
    root, yaw = root_path(y[:, layout.y_root_velocity], turn), headings(turn)
    frame_step = round(60 / FPS)  # rows have 60 frames a second, the page has FPS
    captured, predicted = (
        packed_motion(
            figure,
            in_world(of_joints[:, 0], root, yaw, ground)[::frame_step],
            quat.mul(quat.yaw(yaw)[:, None], quat.exp(of_joints[:, 2]))[::frame_step],
            drawn_joints,
        )
        for of_joints in poses
    )
    return {
        "name": rows.clip,
        "split": split,
        "frames": len(error[::frame_step]),
        "captured": captured,
        "predicted": predicted,
        "error": np.round(error[::frame_step], 2).tolist(),
    }


def in_world(points: Array, root: Array, yaw: Array, ground: Array) -> Array:
    """World positions (F, J, 3) of points (F, J, 3) that are given in the coordinates of the root, cm.

    root: (F, 3) positions of the root, cm. yaw: (F,) directions of the root, radians. ground: (F, 1) mean
    height of the ground, cm. It is added, because the heights of the points are measured from the ground.
    """
    world = points.copy()
    world[..., ::2] = rotate_by_yaw(points[..., ::2], yaw[:, None])
    world[..., 1] += ground
    return world + root[:, None]
