"""Gait shares: the overwritten crouch of flat clips, and the gaits of a clip that nobody labelled."""

from __future__ import annotations

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.labels.model import GAITS

CROUCH = GAITS.index("crouch")


def overwrite_crouch(gait: Array, clip: Clip) -> Array:
    """Gait (F, 6) of a clip on flat ground with crouch = 1 - clip((head height - 80) / 50, 0, 1).

    The other columns stay as they are (`pfnn-facts`, Labels), so that shares need not add up to 1.
    """
    head = clip.positions[:, clip.skeleton.role("head"), 1]
    out = gait.copy()
    out[:, CROUCH] = 1 - np.clip((head - 80.0) / 50.0, 0.0, 1.0)
    return out


def automatic_gait(clip: Clip, footsteps: Array, dominant: str | None) -> Array:
    """Gait shares (F, 6) from how fast the body goes and how low the head is."""
    from scipy.ndimage import gaussian_filter1d

    frames = len(clip)
    root = gaussian_filter1d(clip.root[:, [0, 2]], 6.0, axis=0, mode="nearest")
    speed = np.linalg.norm(np.gradient(root, axis=0), axis=1) if frames > 1 else np.zeros(frames)
    speed = gaussian_filter1d(speed, 15.0, mode="nearest")
    share = np.zeros((frames, len(GAITS)))
    walking = np.clip((speed - 0.15) / 0.3, 0.0, 1.0)
    jogging = np.clip((speed - 3.3) / 0.8, 0.0, 1.0)
    share[:, 0] = 1 - walking
    share[:, 1] = walking * (1 - jogging)
    share[:, 2] = walking * jogging
    return share
