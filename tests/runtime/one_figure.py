"""A crouched figure, and its foot placement from frame to frame."""

from __future__ import annotations

import numpy as np

from hobble.core import quat
from hobble.core.skeleton import Skeleton, forward_kinematics
from hobble.runtime.feet import foot_parts, leg_joints, place_feet, rest_facing


def crouched(skeleton: Skeleton, thigh: float = 0.5, knee: float = 0.9) -> tuple[np.ndarray, np.ndarray]:
    """Positions (J, 3) and world rotations (J, 4) of a figure. Radians: thighs forward, knees bent."""
    local = np.tile([1.0, 0, 0, 0], (1, len(skeleton.joints), 1))
    for side in ("left", "right"):
        local[0, skeleton.role(f"{side}_hip")] = quat.from_axis_angle([1.0, 0, 0], -thigh)
        local[0, skeleton.role(f"{side}_knee")] = quat.from_axis_angle([1.0, 0, 0], knee)
    rotations, positions = forward_kinematics(skeleton, local, np.array([[0.0, 90.0, 0.0]]))
    return positions[0], rotations[0]


class Feet:
    """`place_feet` with its state, on one figure."""

    def __init__(self, skeleton: Skeleton, *bent: float) -> None:
        self.legs = leg_joints(skeleton)
        self.below = foot_parts(skeleton, self.legs)
        self.lock, self.hold, self.lift = np.zeros((1, 2)), np.zeros((1, 2, 2)), np.zeros((1, 2))
        self.step, self.missed = np.zeros((1, 2)), np.zeros((1, 2))
        self.added = np.tile([1.0, 0, 0, 0], (1, 2, 2, 1))
        self.ahead, self.fastest = rest_facing(skeleton), 1e8
        self.base = crouched(skeleton, *bent)
        self.shown, self.height = self.base[0][None, self.legs[:, 1:]], np.zeros(1)

    def __call__(
        self,
        moved: np.ndarray,
        contact: float,
        ground: float | None = None,
        locking: bool = True,
        other: float = 0.0,
    ):
        if ground is None:  # just under the feet, neither sunk nor floating
            ground = min(self.base[0][self.legs[0, 2], 1] - 5.0, self.base[0][self.legs[0, 3], 1] - 4.0) - 1.0
        position, rotation = self.base[0][None] + moved, self.base[1][None].copy()
        contacts = np.array([[contact, contact, other, other]], np.float32)
        legs = self.legs, self.below, np.array([5.0, 4.0]), self.ahead, self.fastest
        held = self.lock, self.hold, self.step, self.missed
        feet = held, self.lift, self.added, self.shown, self.height, np.zeros(1)
        place_feet(contacts, np.full((1, 4), ground), locking, legs, feet, position, rotation)
        self.contacts, self.ground = contacts[0], ground
        self.rotation = rotation[0]
        return position[0]
