"""Made-up motion for several tests: captured walks, and rows of random values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from hobble.rows.clip_rows import Captured, ClipRows
from hobble.rows.layout import GAITS, RowLayout


def captured_walk(name: str, local: np.ndarray, channels: Mapping[str, np.ndarray]) -> Captured:
    """A walk straight ahead with the joints `local` (F, J, 3). channels: name -> (F, columns)."""
    frames = len(local)
    contacts, still, rows = np.zeros((frames, 4)), np.zeros(frames), np.arange(frames)
    contacts[:, 0] = contacts[:, 3] = np.sin(2 * np.pi * rows / 60) > 0
    gait = np.tile(np.eye(len(GAITS))[GAITS.index("walk")], (frames, 1))
    velocity, root = np.tile([0.0, 2.0], (frames, 1)), np.zeros((frames, 3))
    root[:, 2] = 2.0 * rows
    return Captured(name, local, contacts, still, dict(channels), gait, velocity, root, still, rows)


def random_rows(
    clip: str, layout: RowLayout, skeleton: Any, rows: int, fits: int, seed: int, spread: float = 1.0
) -> ClipRows:
    """Random rows with `fits` fits each, and severities from 0 to 10. spread: of Y."""
    rng = np.random.default_rng(seed)
    return ClipRows(
        clip,
        layout,
        skeleton,
        rng.normal(size=(rows, layout.x_terrain.start)).astype(np.float32),
        rng.normal(2, spread, (rows, layout.y_size)).astype(np.float32),
        rng.random(rows).astype(np.float32),
        {name: rng.random((rows, columns)).astype(np.float32) * 10 for name, columns in layout.channels},
        np.arange(rows),
        np.zeros(rows, int),
        np.full(rows, fits),
        rng.normal(size=(rows * fits, 36)).astype(np.float32),
        rng.normal(size=rows * fits).astype(np.float32),
    )
