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
from hobble.motion.spine import SHORT, Spine

LEFT = np.array([1.0, 0.0, 0.0])
FLEXED = 0.05  # a knee or elbow with a larger mean sine of its bend shows where the limb's front is


class BodySample:
    """A sample of frames of a body: bones, facing directions, and how joints are turned.

    A joint's frame is the rotation (4,) from the axes of a figure that stands facing +Z with its arms out to
    the joint's own axes. The joint's world rotation times its frame is the turn of the body part from that
    stance.

    positions: (S, J, 3) cm. rotations: (S, J, 4) in the world. speeds: (S, J) cm a second. rest: (J, 3)
    positions in the zero pose. ends: position of an ankle's end site, if it has one. spine: the shape of the
    target's trunk in that stance. target_tilt: radians by which the bones from ankle to ball point down on
    the target. seconds: length of the clip.
    """

    def __init__(
        self,
        body: Body,
        positions: Array,
        rotations: Array,
        speeds: Array,
        rest: Array,
        ends: Mapping[str, tuple[float, float, float] | None],
        spine: Spine,
        target_tilt: float,
        seconds: float,
    ) -> None:
        self.body, self.at, self.turned, self.speeds = body, positions, rotations, speeds
        self.rest, self.ends, self.spine, self.target_tilt = rest, ends, spine, target_tilt
        self.seconds = seconds
        self.hips_left = self.line(body.legs["right"][0], body.legs["left"][0])
        self.chest_left = self.line(body.arms["right"][1], body.arms["left"][1])

    def part(self, frames: NDArray[np.bool_]) -> BodySample:
        """The sample with some of its frames alone. frames: (S,)."""
        out = copy(self)
        out.at, out.turned, out.speeds = self.at[frames], self.turned[frames], self.speeds[frames]
        out.hips_left, out.chest_left = self.hips_left[frames], self.chest_left[frames]
        return out

    def in_zero_pose(self) -> BodySample:
        """The zero pose as a sample of one frame."""
        out = self.part(np.arange(len(self.at)) == 0)
        out.at, out.turned = self.rest[None], np.broadcast_to(quat.IDENTITY, out.turned.shape)
        body = self.body
        out.hips_left = out.line(body.legs["right"][0], body.legs["left"][0])
        out.chest_left = out.line(body.arms["right"][1], body.arms["left"][1])
        return out

    def line(self, start: int, end: int) -> Array:
        """(S, 3) unit vectors from joint to joint."""
        return unit(self.at[:, end] - self.at[:, start])

    def local(self, joint: int, vectors: Array) -> Array:
        """(3,) mean of world vectors (S, 3) in the joint's coordinates."""
        own = quat.rotate(quat.inv(self.turned[:, joint]), vectors)
        return robust_mean(own)

    def bone(self, start: int, end: int) -> Array:
        """(3,) the bone from `start` to `end`, in the coordinates of `start`."""
        return self.local(start, self.at[:, end] - self.at[:, start])

    def length(self, *joints: int) -> float:
        """Distance between two joints."""
        ways = (self.at[:, b] - self.at[:, a] for a, b in pairwise(joints))
        return sum(float(np.median(np.linalg.norm(way, axis=-1))) for way in ways)

    def first_long(self, joint: int, following: Sequence[int]) -> tuple[Array, int]:
        """(3,) the bone to the first of the following joints that is at another place, and that joint."""
        bones = [(self.bone(joint, end), end) for end in following]
        return next((found for found in bones if np.linalg.norm(found[0]) > SHORT), bones[-1])

    def hinge(self, start: int, middle: int, end: int, otherwise: Array) -> Array:
        """(S, 3) axis of a limb's bend, for a knee to the body's left. `otherwise` if it hardly bends."""
        axis = np.cross(self.line(start, middle), self.line(middle, end))
        own = self.local(start, axis)
        if np.linalg.norm(own) < FLEXED:
            return otherwise
        return quat.rotate(self.turned[:, start], np.broadcast_to(unit(own), axis.shape))

    def hand(self, side: str, straight: Array, sign: float) -> Array:
        """The frame of a hand: its forearm's, but pointing where its fingers are."""
        if side not in self.body.fingers:
            return straight
        return pointed_along(
            straight, sign * LEFT, self.bone(self.body.arms[side][3], self.body.fingers[side])
        )
