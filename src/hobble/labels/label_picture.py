"""Prepares the data of a picture of a clip's labels, as short lists for a page."""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import mean
from hobble.labels.clip_labels import CONTACT_ROLES, GAITS, Labels

POINTS = 400  # a curve has at most this many values by default


def make_label_picture(labels: Labels, clip: Clip, points: int = POINTS) -> dict[str, Any]:
    """Contacts, landings, phase, gait and speed over time, under these keys.

    `contacts`: for each joint of CONTACT_ROLES a list of intervals [from, to), in seconds, in which it is on
    the ground. `landings`: for "right" and "left" the times in seconds at which this foot lands. `phase`
    (None where unknown), `gait` (for each gait that occurs) and `speed` (m/s) are curves, lists of at most
    `points` values. `seconds`: the times of these values.
    """
    frames = len(labels)
    chosen = np.unique(np.linspace(0, max(frames - 1, 0), min(frames, points)).round().astype(int))
    phase = [
        round(float(value), 3) if known else None
        for value, known in zip(labels.phase[chosen], labels.phase_known[chosen], strict=True)
    ]
    return {
        "seconds": _round_to_list(chosen / clip.fps),
        "contacts": {
            role: _intervals(labels.contacts[:, i], clip.fps) for i, role in enumerate(CONTACT_ROLES)
        },
        "landings": {
            side: _round_to_list(labels.footsteps[np.isfinite(labels.footsteps[:, i]), i] / clip.fps)
            for i, side in enumerate(("right", "left"))
        },
        "phase": phase,
        "gait": {
            name: _round_to_list(labels.gait[chosen, i])
            for i, name in enumerate(GAITS)
            if labels.gait[:, i].any()
        },
        "speed": _round_to_list(_speed(clip)[chosen]),
    }


def _speed(clip: Clip) -> Array:
    """(F,) speed of the root along the ground in m/s, averaged over a fifth of a second."""
    ground = clip.root[:, [0, 2]]
    if len(ground) < 2:
        return np.zeros(len(ground))
    step = np.linalg.norm(np.gradient(ground, axis=0), axis=1)
    return mean(step, 13) * clip.fps / 100


def _intervals(flags: Array, fps: float) -> list[list[float]]:
    """[from, to) in seconds of each stretch of frames in which `flags` is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return [_round_to_list(pair / fps) for pair in edges.reshape(-1, 2)]


def _round_to_list(values: Array) -> list[float]:
    return [round(float(v), 3) for v in values]
