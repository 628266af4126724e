"""Captured motion and the network's prediction of the next frame, packed for the page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core import quat
from hobble.core.array_parts import ArrayParts
from hobble.core.quat import Array
from hobble.evaluation.captured import headings, root_path, rotate_by_yaw, unbroken
from hobble.figure.mesh import body, key
from hobble.models.network import Network
from hobble.report.scenes import FPS, UNIT, packed_motion
from hobble.rows.clip_rows import ClipRows, load_clip_rows, pairs

CLIPS = 6  # fewest clips to show, if there are as many; training clips are added up to this number
MOST = 16  # most held-out clips to show; one takes up to 230 kB
LONGEST = 12 * 60  # most frames to show of a clip


def comparisons(network: Network, paths: Iterable[str | Path], splits: Mapping[str, str]) -> dict[str, Any]:
    """The longest unbroken stretch of each shown clip, captured and predicted; {} without clips.

    paths: `database/clips/<clip>.npz`. Shown are up to MOST held-out clips, and training clips if there are
    fewer than CLIPS. Each pose is predicted from the captured input of the frame before, on the first terrain
    fit of the row. Both motions are drawn at the captured root.
    """
    if network.skeleton is None:
        return {}
    keep = body(network.skeleton).bones.tolist()
    order = sorted(paths, key=lambda path: (splits.get(Path(path).stem) != "held_out", Path(path).stem))
    clips = []
    held_out = sum(splits.get(Path(path).stem) == "held_out" for path in order)
    # Take clips from all over the list: neighbours in it are often takes of the same motion.
    for path in order[: max(CLIPS, held_out)][:: max(1, -(-held_out // MOST))]:
        rows = load_clip_rows(path, longest_stretch(path))
        if rows.layout.joints == network.layout.joints and len(rows):
            clips.append(_compared(network, rows, splits.get(rows.clip, "train"), keep))
    found = {"fps": FPS, "unit": UNIT, "joints": len(keep), "body": key(network.skeleton), "clips": clips}
    return found if clips else {}


def longest_stretch(path: str | Path) -> tuple[int, int]:
    """(first, stop): the rows of a clip's longest unbroken stretch, or of its first LONGEST frames."""
    stretches = unbroken(ArrayParts(path).whole("frame"))
    if not stretches:
        return 0, 0
    longest = max(stretches, key=len)[:LONGEST]
    return int(longest[0]), int(longest[-1]) + 1


def _compared(network: Network, rows: ClipRows, split: str, keep: list[int]) -> dict[str, Any]:
    (chosen,) = unbroken(rows.frame)
    layout, figure = network.layout, network.skeleton
    assert figure is not None
    pose = slice(layout.y_joint_position.start, layout.y_joint_rotation.stop)
    asked = pairs(rows, layout, chosen, rows.first_fit[chosen])
    truth, guess = (y[:, pose].astype(float) for y in (asked.y, network.predict(asked.x, asked.p)))
    parts = [v.reshape(len(chosen), 3, -1, 3) for v in (truth, guess)]
    error = np.linalg.norm(parts[0][:, 0] - parts[1][:, 0], axis=-1).mean(axis=1)
    lift = rows.mean[rows.first_fit[chosen]][:, None]
    y = rows.y[chosen].astype(float)
    turn = y[:, layout.y_turn][:, 0]
    place, yaw = root_path(y[:, layout.y_root_velocity], turn), headings(turn)
    stride = round(60 / FPS)
    captured, predicted = (
        packed_motion(
            figure,
            in_world(part[:, 0], place, yaw, lift)[::stride],
            quat.mul(quat.yaw(yaw)[:, None], quat.exp(part[:, 2]))[::stride],
            keep,
        )
        for part in parts
    )
    return {
        "name": rows.clip,
        "split": split,
        "frames": len(error[::stride]),
        "captured": captured,
        "predicted": predicted,
        "error": np.round(error[::stride], 2).tolist(),
    }


def in_world(points: Array, place: Array, yaw: Array, lift: Array) -> Array:
    """World positions (F, J, 3), cm, of points (F, J, 3) relative to a root at place (F, 3) with yaw (F,).

    lift: (F, 1) cm that were subtracted from the heights.
    """
    out = points.copy()
    out[..., ::2] = rotate_by_yaw(points[..., ::2], yaw[:, None])
    out[..., 1] += lift
    return out + place[:, None]
