"""Measures a body in some moments of its motion: its bones, how its limbs bend, and where its hands point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.body import Body
from hobble.motion.orient import robust_mean, rotation_pointing_along, unit_vectors
from hobble.motion.spine import SHORT
from hobble.motion.target_build import TargetProportions

LEFT = np.array([1.0, 0.0, 0.0])  # the left of a figure that faces +Z
# A knee or elbow shows the axis about which it bends if the mean sine of its bend is larger than this.
FLEXED = 0.05


class BodySample:
    """S moments of a clip, chosen to show how the axes of a rig's joints are turned relative to its body.

    In this class, the frame of a joint is not a moment of the clip but a constant rotation F (4,). Let R be
    the joint's rotation in the world. R F is the identity while the figure stands in a T-pose facing +Z (with
    its arms out sideways). At other times, R F is how far the body part has turned from the T-pose.

    body: which joint is which part. positions: (S, J, 3) cm. rotations: (S, J, 4) in the world. speeds:
    (S, J) cm a second. zero_positions: (J, 3) in the zero pose, in which all rotations are 0.
    ankle_end_sites: side -> (3,) offset from the ankle to its end site in the file, None without one.
    target_proportions: those of the skeleton to which the clip will be retargeted. seconds: length of the
    clip.

    Other fields: hips_left, (S, 3) unit vectors from the right hip to the left hip; chest_left, the same for
    the shoulders.
    """

    def __init__(
        self,
        body: Body,
        positions: Array,
        rotations: Array,
        speeds: Array,
        zero_positions: Array,
        ankle_end_sites: Mapping[str, tuple[float, float, float] | None],
        target_proportions: TargetProportions,
        seconds: float,
    ) -> None:
        self.body, self.positions, self.rotations, self.speeds = body, positions, rotations, speeds
        self.zero_positions, self.ankle_end_sites = zero_positions, ankle_end_sites
        self.target_proportions, self.seconds = target_proportions, seconds
        self.hips_left = self.directions(body.legs["right"][0], body.legs["left"][0])
        self.chest_left = self.directions(body.arms["right"][1], body.arms["left"][1])

    def at_moments(self, moments: NDArray[np.bool_]) -> BodySample:
        """The sample with only some of its moments. moments: (S,), True for each moment to keep."""
        out = copy(self)
        out.positions, out.rotations = self.positions[moments], self.rotations[moments]
        out.speeds = self.speeds[moments]
        out.hips_left, out.chest_left = self.hips_left[moments], self.chest_left[moments]
        return out

    def in_zero_pose(self) -> BodySample:
        """The zero pose as a sample of one moment. Its `speeds` are those of this sample's first moment."""
        out = self.at_moments(np.arange(len(self.positions)) == 0)
        out.positions = self.zero_positions[None]
        out.rotations = np.broadcast_to(quat.IDENTITY, out.rotations.shape)
        body = self.body
        out.hips_left = out.directions(body.legs["right"][0], body.legs["left"][0])
        out.chest_left = out.directions(body.arms["right"][1], body.arms["left"][1])
        return out

    def directions(self, start: int, end: int) -> Array:
        """(S, 3) unit vectors from the joint `start` to the joint `end`."""
        return unit_vectors(self.positions[:, end] - self.positions[:, start])

    def mean_in_joint_axes(self, joint: int, vectors: Array) -> Array:
        """(3,) mean of `vectors` without outliers, in the joint's own axes.

        vectors: (S, 3) in the axes of the world.
        """
        in_own_axes = quat.rotate(quat.inv(self.rotations[:, joint]), vectors)
        return robust_mean(in_own_axes)

    def bone(self, start: int, end: int) -> Array:
        """(3,) mean vector from the joint `start` to the joint `end`, in the own axes of `start`."""
        return self.mean_in_joint_axes(start, self.positions[:, end] - self.positions[:, start])

    def length(self, *joints: int) -> float:
        """Length of a chain of joints, cm: the sum of the distances from each joint to the next.

        Each distance is the median over the sample.
        """
        vectors = (self.positions[:, b] - self.positions[:, a] for a, b in pairwise(joints))
        return sum(float(np.median(np.linalg.norm(vector, axis=-1))) for vector in vectors)

    def first_long_bone(
        self, joint: int, following: Sequence[int], least: float = SHORT
    ) -> tuple[Array, int]:
        """Find the first joint of `following` that is over `least` cm away from `joint`, or else the last.

        Returns the (3,) `bone` from `joint` to the joint found, and the joint found.
        """
        bones = [(self.bone(joint, end), end) for end in following]
        return next((found for found in bones if np.linalg.norm(found[0]) > least), bones[-1])

    def hinge_axes(self, start: int, middle: int, end: int, otherwise: Array) -> Array:
        """(S, 3) axis about which a limb of three joints bends, in the axes of the world.

        The axis turns with the joint `start`. For a leg it points to the body's left. otherwise: (S, 3), is
        returned if the limb hardly bends.
        """
        axis = np.cross(self.directions(start, middle), self.directions(middle, end))
        mean_axis = self.mean_in_joint_axes(start, axis)
        if np.linalg.norm(mean_axis) < FLEXED:
            return otherwise
        return quat.rotate(self.rotations[:, start], np.broadcast_to(unit_vectors(mean_axis), axis.shape))

    def hand_frame(self, side: str, straight: Array, sign: float) -> Array:
        """(4,) the frame of a hand.

        The direction of the hand is taken to be that from the wrist to the base of one finger (the joint in
        `Body.fingers`).

        straight: (4,) the frame of a hand that is in line with its forearm. It is turned to the finger, or
        returned unchanged if `Body.fingers` has no joint for this hand. sign: 1 for the left hand, whose arm
        points to +X in the T-pose, and -1 for the right hand.
        """
        if side not in self.body.fingers:
            return straight
        return rotation_pointing_along(
            straight, sign * LEFT, self.bone(self.body.arms[side][3], self.body.fingers[side])
        )
