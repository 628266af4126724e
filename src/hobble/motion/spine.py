"""Describes the shape of trunk and neck in a standing rest pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion.axes import rest_frame
from hobble.motion.body import REACH, Body
from hobble.motion.orient import unit_vectors

SHORT = 2.0  # cm: a bone shorter than this does not show a direction


@dataclass(frozen=True)
class Spine:
    """The points where trunk and neck may bend, in a rest pose that stands facing +Z.

    These are joints. A joint less than SHORT above the one before it is left out. points: (N, 3) cm, from the
    hips up. shares: (N,) position of each point along the body: 0 at the hips, 1 at the chest, 2 at the head.
    """

    shares: Array
    points: Array

    @classmethod
    def from_skeleton(cls, skeleton: Skeleton, body: Body) -> Spine:
        """The spine of a skeleton with a standing rest pose. body: which joint is which part.

        The skeleton is the target of retargeting. In the new rest pose of another rig, the bones of trunk and
        neck get the directions of this spine.
        """
        rest = quat.rotate(quat.inv(rest_frame(skeleton)), rest_positions(skeleton))
        chain = (body.hips, *body.trunk, *body.neck, body.head)
        places = rest[list(chain)]
        lengths = np.linalg.norm(np.diff(places, axis=0), axis=-1)
        used = [0, *(k for k, length in enumerate(lengths, 1) if length > SHORT)]
        return cls(spine_shares(lengths, body.trunk_bones)[used], places[used])

    def direction(self, start: float, end: float) -> Array:
        """(3,) unit direction that a bone of another rig gets from this spine.

        start, end: positions along the body between which the bone lies, counted like `shares`. If the rig
        has fewer joints, one of its bones may span several bones of this spine.
        """
        chest, first = int(np.searchsorted(self.shares, 1.0 - 1e-6)), self._first_point(start)
        # A bone that ends at the chest or below does not reach into the neck.
        last = min(self._last_point(end), chest if end <= 1 else len(self.shares) - 1)
        return unit_vectors(self.points[max(last, first + 1)] - self.points[first])

    def bone_end(self, start: float) -> float:
        """Position along the body of the upper end of a bone of this spine. start: that of its lower end."""
        return float(self.shares[self._first_point(start) + 1])

    @property
    def neck_direction(self) -> Array:
        """(3,) unit direction from the chest to the next point: the neck, or the head if there is no neck."""
        chest = min(int(np.searchsorted(self.shares, 1.0 - 1e-6)), len(self.shares) - 2)
        return unit_vectors(self.points[chest + 1] - self.points[chest])

    @property
    def has_neck(self) -> bool:
        """Whether there is a point between chest and head."""
        return bool(((self.shares > 1.0 + 1e-6) & (self.shares < 2.0 - 1e-6)).any())

    def _first_point(self, start: float) -> int:
        """Index of the point at which the bone from position `start` along the body begins."""
        chest = int(np.searchsorted(self.shares, 1.0 - 1e-6))
        return max(min(self._last_point(start), chest - 1 if start < 1 else len(self.shares) - 2), 0)

    def _last_point(self, share: float) -> int:
        """Index of the highest point that is at most REACH above the position `share` along the body."""
        return int(np.searchsorted(self.shares, share + REACH, side="right")) - 1


def spine_shares(lengths: Array, trunk_bones: int) -> Array:
    """(N,) position of each joint along the body: 0 at the hips, 1 at the chest, 2 at the head.

    lengths: (N-1,) of the bones from the hips through trunk and neck to the head. trunk_bones: how many of
    them belong to the trunk. The last of these ends at the chest.
    """
    distances = np.concatenate([[0.0], np.cumsum(lengths)])  # from the hips, along the bones
    below, above = distances[: trunk_bones + 1], distances[trunk_bones:] - distances[trunk_bones]
    shares = np.concatenate(
        [below[:-1] / max(float(below[-1]), 1e-9), 1.0 + above / max(float(above[-1]), 1e-9)]
    )
    shares[0] = 0.0  # also if the hips carry the arms and are the chest
    return shares
