"""A walk, a ground and a comparison that tests of the character share."""

from dataclasses import fields

import numpy as np

from hobble.runtime import Pose, ProceduralAnimation

KNEE = "LeftUpLeg-LeftLeg"


def walk(character: ProceduralAnimation, frames: int, **targets) -> list[Pose]:
    targets = {"target_velocity": (0.5, 2.0)} | targets
    return [character.next_pose(**targets) for _ in range(frames)]


def hills(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    return 8 * np.sin(x / 60) + 5 * np.cos(z / 45)


def same(a, b) -> bool:
    """Whether two states are equal, bit for bit."""
    return all(np.array_equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))


def same_poses(a: Pose, b: Pose) -> None:
    """Fail unless two poses are equal, bit for bit."""
    for name in ("positions", "rotations", "contacts", "phase", "root", "yaw"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), name)
