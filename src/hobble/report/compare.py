"""Captured motion beside what the network predicts for its next frame, packed to be played in the page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.database.clip_rows import ClipRows, expanded, load_clip_rows
from hobble.evaluation.predict import predict
from hobble.report.body import body
from hobble.report.scenes import FPS, UNIT, pack_positions, packed
from hobble.runtime.network import Network

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
    chosen = longest_run(rows.frame)[:LONGEST]
    y_position = network.layout.y_joint_position
    truth, guess = np.zeros((2, len(rows), y_position.stop - y_position.start))
    seen = np.zeros(len(rows), bool)
    for pairs in expanded(rows, links=network.layout.links > 0):
        row, first = np.unique(pairs.row, return_index=True)
        wanted = np.isin(row, chosen) & ~seen[row]
        row, first = row[wanted], first[wanted]
        if len(row):
            made = predict(network, pairs.x[first], pairs.p[first])
            truth[row], guess[row] = pairs.y[first][:, y_position], made[:, y_position]
            seen[row] = True
    true, predicted = (v[chosen].reshape(len(chosen), -1, 3) for v in (truth, guess))
    error = np.linalg.norm(true - predicted, axis=-1).mean(axis=1)
    lift = rows.mean[rows.first_fit[chosen]][:, None]
    y = rows.y[chosen].astype(float)
    place, yaw = travelled(y[:, network.layout.y_root_velocity], y[:, network.layout.y_turn][:, 0])
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


def longest_run(frame: np.ndarray) -> np.ndarray:
    """Rows of the longest stretch without a gap; of the two rows of a frame that two cycles share, the first.

    >>> longest_run(np.array([3, 4, 7, 8, 8, 9])).tolist()
    [2, 3, 5]
    """
    _, first = np.unique(frame, return_index=True)
    pieces = np.split(first, np.flatnonzero(np.diff(frame[first]) != 1) + 1)
    return max(pieces, key=len)


def travelled(velocity: Array, turn: Array) -> tuple[Array, Array]:
    """Places (F, 2) and yaws (F,) of a root that moves by `velocity` (F, 2), seen from itself, then turns.

    turn: of the world seen from the root, so that the root turns by its negative.
    """
    yaw = np.concatenate([[0.0], -np.cumsum(turn)[:-1]])
    sin, cos = np.sin(yaw), np.cos(yaw)
    x, z = velocity.T
    steps = np.stack([x * cos + z * sin, z * cos - x * sin], axis=1)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)[:-1]]), yaw


def in_world(points: Array, place: Array, yaw: Array, lift: Array) -> Array:
    """World positions (F, J, 3) of points in the root frame; lift (F, 1): what was taken off heights."""
    sin, cos = np.sin(yaw)[:, None], np.cos(yaw)[:, None]
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x * cos + z * sin + place[:, :1], y + lift, z * cos - x * sin + place[:, 1:]], axis=-1)
