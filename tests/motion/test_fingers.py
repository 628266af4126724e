"""The finger that shows the direction of the hand, by name and by length."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.motion.body import pointing_fingers


def hand(wrist: str, *fingers: tuple[str, float]) -> Skeleton:
    """An elbow, a wrist 25 cm from it, and joints that are all children of the wrist."""
    joints = ("Elbow", wrist, *(name for name, _ in fingers))
    offsets = np.array([[0, 0, 0], [25, 0, 0], *([length, 0, 0] for _, length in fingers)], float)
    return Skeleton("hand", joints, (-1, 0, *(1 for _ in fingers)), offsets)


@pytest.mark.parametrize(
    ("wrist", "fingers", "chosen"),
    [
        ("Hand", [("Thumb1", 9.0), ("Pinky1", 8.0), ("Index1", 7.0)], "Index1"),
        ("Bip01 L Hand", [("Bip01 L Finger0", 9.0), ("Bip01 L Finger1", 7.0)], "Bip01 L Finger1"),
        ("LeftHand", [("LeftFinger1Metacarpal", 8.0), ("LeftFinger2Proximal", 6.0)], "LeftFinger2Proximal"),
        ("Bip01 L Hand", [("Bip01 L Finger0", 7.0)], "Bip01 L Finger0"),
        ("L_Wrist", [("grip", 12.0), ("L_Hand", 7.0)], "L_Hand"),
        ("kalo", [("mi", 6.0), ("ru", 8.0), ("sword", 90.0)], "ru"),
        ("Hand", [("Thumb1", 9.0), ("Sword", 90.0)], None),
    ],
)
def test_the_pointing_finger_is_chosen(wrist, fingers, chosen):
    skeleton = hand(wrist, *fingers)
    found = pointing_fingers(skeleton, {"left": 1})
    assert ({"left": chosen} if chosen else {}) == {s: skeleton.joints[j] for s, j in found.items()}
