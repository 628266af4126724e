"""Captured motion and the network's prediction of the next frame, packed for the page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.array_parts import ArrayParts
from hobble.core.quat import Array
from hobble.evaluation.captured import headings, root_path, rotate_by_yaw, unbroken_stretches
from hobble.figure.mesh import body, mesh_key
from hobble.models.network import Network
from hobble.report.scenes import FPS, UNIT, packed_motion
from hobble.rows.clip_rows import ClipRows, load_clip_rows, pairs

FEWEST_CLIPS = 6  # if fewer clips are held out, training clips are added up to this number
MOST_HELD_OUT = 16  # at most this many held-out clips are shown; each takes up to 230 kB of the page
LONGEST = 12 * 60  # at most this many frames of a clip are shown


def comparisons(network: Network, paths: Iterable[str | Path], splits: Mapping[str, str]) -> dict[str, Any]:
    """The longest unbroken stretch of each shown clip, captured and predicted; {} without clips.

    paths: `database/clips/<clip>.npz`. splits: clip -> "held_out" or "train". At most MOST_HELD_OUT held-out
    clips are shown. If fewer than FEWEST_CLIPS are held out, training clips are added. Each pose is predicted
    from the captured input of the frame before, on the first of the terrains fitted to the clip. Both motions
    are drawn at the captured root.
    """
    if network.skeleton is None:
        return {}
    keep = body(network.skeleton).bones.tolist()
    order = sorted(paths, key=lambda path: (splits.get(Path(path).stem) != "held_out", Path(path).stem))
    clips = []
    held_out = sum(splits.get(Path(path).stem) == "held_out" for path in order)
    # Take clips from all over the list: neighbours in it are often takes of the same motion.
    for path in order[: max(FEWEST_CLIPS, held_out)][:: max(1, -(-held_out // MOST_HELD_OUT))]:
        rows = load_clip_rows(path, longest_stretch(path))
        if rows.layout.joints == network.layout.joints and len(rows):
            clips.append(_compared(network, rows, splits.get(rows.clip, "train"), keep))
    if not clips:
        return {}
    mesh = mesh_key(network.skeleton)
    return {"fps": FPS, "unit": UNIT, "joints": len(keep), "body": mesh, "clips": clips}


def longest_stretch(path: str | Path) -> tuple[int, int]:
    """(start, stop): the rows of a clip's longest unbroken stretch, cut to LONGEST frames."""
    stretches = unbroken_stretches(ArrayParts(path).whole("frame"))
    if not stretches:
        return 0, 0
    longest = max(stretches, key=len)[:LONGEST]
    return int(longest[0]), int(longest[-1]) + 1


def _compared(network: Network, rows: ClipRows, split: str, keep: list[int]) -> dict[str, Any]:
    (chosen,) = unbroken_stretches(rows.frame)
    layout, figure = network.layout, network.skeleton
    assert figure is not None
    pose = slice(layout.y_joint_position.start, layout.y_joint_rotation.stop)
    samples = pairs(rows, layout, chosen, rows.first_fit[chosen])
    outputs = (samples.y, network.predict(samples.x, samples.p))
    # Captured and predicted, each an array (F, 3, J, 3): position, velocity and rotation of each joint.
    poses = [y[:, pose].astype(float).reshape(len(chosen), 3, -1, 3) for y in outputs]
    error = np.linalg.norm(poses[0][:, 0] - poses[1][:, 0], axis=-1).mean(axis=1)
    ground = rows.mean[rows.first_fit[chosen]][:, None]
    y = rows.y[chosen].astype(float)
    turn = y[:, layout.y_turn][:, 0]
    root, yaw = root_path(y[:, layout.y_root_velocity], turn), headings(turn)
    frame_step = round(60 / FPS)
    captured, predicted = (
        packed_motion(
            figure,
            in_world(of_joints[:, 0], root, yaw, ground)[::frame_step],
            quat.mul(quat.yaw(yaw)[:, None], quat.exp(of_joints[:, 2]))[::frame_step],
            keep,
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
    """World positions (F, J, 3), cm, of points (F, J, 3) relative to the root.

    root: (F, 3) its positions, cm. yaw: (F,) its directions, radians. ground: (F, 1) mean height of the
    ground, cm, which was subtracted from the heights of the points.
    """
    out = points.copy()
    out[..., ::2] = rotate_by_yaw(points[..., ::2], yaw[:, None])
    out[..., 1] += ground
    return out + root[:, None]
