"""The data of a picture of a clip's labels, as small arrays for the report."""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import mean
from hobble.labels.clip_labels import CONTACT_ROLES, GAITS, Labels

POINTS = 400  # a curve has at most this many values by default


def label_picture(labels: Labels, clip: Clip, points: int = POINTS) -> dict[str, Any]:
    """Contacts, landings, phase, gait and speed over time. Curves have at most `points` values.

    `contacts`: for each joint a list of [from, to) in seconds. `landings`: for each foot the times in seconds
    at which it lands. `seconds`: the times of the curves. The curves are `phase` (None where unknown), `gait`
    (one for each gait) and `speed` (m/s).
    """
    frames = len(labels)
    at = np.unique(np.linspace(0, max(frames - 1, 0), min(frames, points)).round().astype(int))
    phase = [
        round(float(value), 3) if known else None
        for value, known in zip(labels.phase[at], labels.phase_known[at], strict=True)
    ]
    return {
        "seconds": _rounded(at / clip.fps),
        "contacts": {
            role: _intervals(labels.contacts[:, i], clip.fps) for i, role in enumerate(CONTACT_ROLES)
        },
        "landings": {
            side: _rounded(labels.footsteps[np.isfinite(labels.footsteps[:, i]), i] / clip.fps)
            for i, side in enumerate(("right", "left"))
        },
        "phase": phase,
        "gait": {
            name: _rounded(labels.gait[at, i]) for i, name in enumerate(GAITS) if labels.gait[:, i].any()
        },
        "speed": _rounded(_speed(clip)[at]),
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
    return [_rounded(pair / fps) for pair in edges.reshape(-1, 2)]


def _rounded(values: Array) -> list[float]:
    return [round(float(v), 3) for v in values]
