"""Which heels and toes stand on the ground: those that do not move."""

from __future__ import annotations

import numpy as np

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.labels.model import CONTACT_ROLES


def foot_positions(clip: Clip) -> Array:
    """(F, 4, 3) positions of the joints in the order of CONTACT_ROLES, cm."""
    return clip.positions[:, [clip.skeleton.role(role) for role in CONTACT_ROLES]]


def foot_contacts(clip: Clip, threshold: float) -> np.ndarray:
    """(F, 4) bool: whether a joint moves less than the root of `threshold` (cm2) to the next frame.

    There is no test of height (`pfnn-facts`, Labels). The last frame repeats the one before it.
    """
    feet = foot_positions(clip)
    still = np.sum(np.diff(feet, axis=0) ** 2, axis=-1) < threshold
    if not len(still):
        return np.ones((len(feet), len(CONTACT_ROLES)), bool)
    return np.concatenate([still, still[-1:]])
