"""Grounds for walks that terrain is fitted to: heights at x, z, by name."""

from __future__ import annotations

import numpy as np

GROUNDS = {
    "level": lambda x, z: np.zeros_like(z),
    "slope": lambda x, z: 0.2 * z + 0.05 * x,
    "waves": lambda x, z: 12 * np.sin(z / 70) + 5 * np.sin(x / 9),
    "steps": lambda x, z: 15 * np.clip(np.floor(z / 60) % 6, 0, 4),
}
