"""Captured motion beside what the network predicts for its next frame, packed to be played in the page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.evaluation.captured import headings, root_path, turned, unbroken
from hobble.models.network import Network
from hobble.models.packing import packed
from hobble.report.body import body
from hobble.report.scenes import FPS, UNIT, pack_positions
from hobble.rows.clip_rows import ClipRows, expanded, load_clip_rows

CLIPS = 6  # that are shown at least, if there are so many; every held-out clip is
MOST = 40
LONGEST = 12 * 60  # frames of a clip that are shown


def comparisons(network: Network, paths: Iterable[str | Path], splits: Mapping[str, str]) -> dict[str, Any]:
    """The longest unbroken stretch of each held-out clip, and of others up to CLIPS in all; {} without any.

    paths: `database/clips/<clip>.npz`. Predictions are one frame ahead from the true input, on the first fit
    of each row, as accuracy is measured; both are drawn at the captured root.
    """
    if network.skeleton is None:
        return {}
    dressed = body(network.skeleton.joints, network.skeleton.parents, network.skeleton.roles)
    keep = dressed["keep"]
    order = sorted(paths, key=lambda path: (splits.get(Path(path).stem) != "held_out", Path(path).stem))
    clips = []
    held_out = sum(splits.get(Path(path).stem) == "held_out" for path in order)
    for path in order[: min(max(CLIPS, held_out), MOST)]:
        rows = load_clip_rows(path)
        if rows.layout.joints == network.layout.joints and len(rows):
            clips.append(_compared(network, rows, splits.get(rows.clip, "train"), keep))
    found = {"fps": FPS, "unit": UNIT, "joints": len(keep), "body": dressed, "clips": clips}
    return found if clips else {}


def _compared(network: Network, rows: ClipRows, split: str, keep: list[int]) -> dict[str, Any]:
    chosen = max(unbroken(rows.frame), key=len)[:LONGEST]
    y_position = network.layout.y_joint_position
    truth, guess = np.zeros((2, len(rows), y_position.stop - y_position.start))
    seen = np.zeros(len(rows), bool)
    for pairs in expanded(rows, network.layout):
        row, first = np.unique(pairs.row, return_index=True)
        wanted = np.isin(row, chosen) & ~seen[row]
        row, first = row[wanted], first[wanted]
        if len(row):
            made = network.predict(pairs.x[first], pairs.p[first])
            truth[row], guess[row] = pairs.y[first][:, y_position], made[:, y_position]
            seen[row] = True
    true, predicted = (v[chosen].reshape(len(chosen), -1, 3) for v in (truth, guess))
    error = np.linalg.norm(true - predicted, axis=-1).mean(axis=1)
    lift = rows.mean[rows.first_fit[chosen]][:, None]
    y = rows.y[chosen].astype(float)
    turn = y[:, network.layout.y_turn][:, 0]
    place, yaw = root_path(y[:, network.layout.y_root_velocity], turn), headings(turn)
    stride = round(60 / FPS)
    world = [in_world(p, place, yaw, lift)[::stride] for p in (true, predicted)]
    captured = pack_positions(world[0], keep)
    steps = np.round((world[1][:, keep] - world[0][:, :1].astype(np.float32)) / UNIT)
    return {
        "name": rows.clip,
        "split": split,
        "frames": len(world[0]),
        **captured,
        "predicted": packed(np.clip(steps, -32767, 32767).astype(np.int16)),
        "error": np.round(error[::stride], 2).tolist(),
    }


def in_world(points: Array, place: Array, yaw: Array, lift: Array) -> Array:
    """World positions (F, J, 3) of points in the root frame of place (F, 3) and yaw (F,).

    lift: (F, 1), what was taken off heights.
    """
    out = points.copy()
    out[..., ::2] = turned(points[..., ::2], yaw[:, None])
    out[..., 1] += lift
    return out + place[:, None]
