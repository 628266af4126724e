"""Measures a body in some frames of its motion: its bones, where its parts face, and its standing feet."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from hobble.core import quat
from hobble.core.quat import Array
from hobble.motion.body import Body
from hobble.motion.orient import pointed_along, robust_mean, unit
from hobble.motion.spine import SHORT
from hobble.motion.target_build import TargetBuild

LEFT = np.array([1.0, 0.0, 0.0])  # the left of a figure that faces +Z
FLEXED = 0.05  # a knee or elbow shows the axis of its bend if the mean sine of the bend is larger than this


class BodySample:
    """S moments of a clip, chosen to show how a rig's joints are turned on its body.

    The frame of a joint (not a moment of the clip) is a rotation (4,), the same at all times: from the axes
    of a figure that stands facing +Z with its arms out sideways to the joint's own axes. The joint's rotation
    in the world times its frame is how far the body part has turned from that stance.

    body: which joint is which part. positions: (S, J, 3) cm, kept as `at`. rotations: (S, J, 4) in the world,
    kept as `turned`. speeds: (S, J) cm a second. rest: (J, 3) positions in the zero pose. ends: side -> (3,)
    offset from the ankle to its end site, or None. target: the build of the skeleton to which the clip will
    be retargeted. seconds: length of the clip.

    hips_left, chest_left: (S, 3) unit vectors from the right hip and shoulder to the left ones.
    """

    def __init__(
        self,
        body: Body,
        positions: Array,
        rotations: Array,
        speeds: Array,
        rest: Array,
        ends: Mapping[str, tuple[float, float, float] | None],
        target: TargetBuild,
        seconds: float,
    ) -> None:
        self.body, self.at, self.turned, self.speeds = body, positions, rotations, speeds
        self.rest, self.ends, self.target, self.seconds = rest, ends, target, seconds
        self.hips_left = self.line(body.legs["right"][0], body.legs["left"][0])
        self.chest_left = self.line(body.arms["right"][1], body.arms["left"][1])

    def part(self, moments: NDArray[np.bool_]) -> BodySample:
        """The sample with only some of its moments. moments: (S,), whether to keep each."""
        out = copy(self)
        out.at, out.turned, out.speeds = self.at[moments], self.turned[moments], self.speeds[moments]
        out.hips_left, out.chest_left = self.hips_left[moments], self.chest_left[moments]
        return out

    def in_zero_pose(self) -> BodySample:
        """The zero pose as a sample of one moment."""
        out = self.part(np.arange(len(self.at)) == 0)
        out.at, out.turned = self.rest[None], np.broadcast_to(quat.IDENTITY, out.turned.shape)
        body = self.body
        out.hips_left = out.line(body.legs["right"][0], body.legs["left"][0])
        out.chest_left = out.line(body.arms["right"][1], body.arms["left"][1])
        return out

    def line(self, start: int, end: int) -> Array:
        """(S, 3) unit vectors from the joint `start` to the joint `end`."""
        return unit(self.at[:, end] - self.at[:, start])

    def local(self, joint: int, vectors: Array) -> Array:
        """(3,) robust mean, along the joint's own axes, of `vectors` (S, 3) along the axes of the world."""
        own = quat.rotate(quat.inv(self.turned[:, joint]), vectors)
        return robust_mean(own)

    def bone(self, start: int, end: int) -> Array:
        """(3,) mean vector from `start` to `end`, along the own axes of `start`."""
        return self.local(start, self.at[:, end] - self.at[:, start])

    def length(self, *joints: int) -> float:
        """Sum of the distances from each of the joints to the next, cm (medians over the sample)."""
        ways = (self.at[:, b] - self.at[:, a] for a, b in pairwise(joints))
        return sum(float(np.median(np.linalg.norm(way, axis=-1))) for way in ways)

    def first_long(self, joint: int, following: Sequence[int], least: float = SHORT) -> tuple[Array, int]:
        """(3,) `bone` from a joint to the first of `following` that is over `least` cm away, and that joint.

        If all are nearer, the last of them is taken.
        """
        bones = [(self.bone(joint, end), end) for end in following]
        return next((found for found in bones if np.linalg.norm(found[0]) > least), bones[-1])

    def hinge(self, start: int, middle: int, end: int, otherwise: Array) -> Array:
        """(S, 3) axis about which a limb of three joints bends, or `otherwise` (S, 3) if it hardly bends.

        The axis is fixed to the joint `start`. For a leg it points to the body's left.
        """
        axis = np.cross(self.line(start, middle), self.line(middle, end))
        own = self.local(start, axis)
        if np.linalg.norm(own) < FLEXED:
            return otherwise
        return quat.rotate(self.turned[:, start], np.broadcast_to(unit(own), axis.shape))

    def hand(self, side: str, straight: Array, sign: float) -> Array:
        """(4,) the frame of a hand: `straight`, turned so that the hand points to its finger.

        straight: (4,) the frame of the hand if it is in line with its forearm. It is returned unchanged for a
        hand without a finger. sign: 1 for the left hand, whose arm points to +X in the stance, -1 for the
        right.
        """
        if side not in self.body.fingers:
            return straight
        return pointed_along(
            straight, sign * LEFT, self.bone(self.body.arms[side][3], self.body.fingers[side])
        )
