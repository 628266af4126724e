"""The shape of trunk and neck in a standing rest pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion.axes import rest_frame
from hobble.motion.body import REACH, Body
from hobble.motion.orient import unit

SHORT = 2.0  # cm: a bone shorter than this has no direction


@dataclass(frozen=True)
class Spine:
    """The points where trunk and neck may bend, in a rest pose that stands facing +Z.

    shares: (N,) position of each point along the body, where hips are at 0, chest at 1 and head at 2. points:
    (N, 3) cm.
    """

    shares: Array
    points: Array

    @classmethod
    def of(cls, skeleton: Skeleton, body: Body) -> Spine:
        """The spine of a skeleton with a standing rest pose. body: its joints.

        When a rig gets a new rest pose, the bones of its trunk and neck get the directions of this spine.
        """
        rest = quat.rotate(quat.inv(rest_frame(skeleton)), rest_positions(skeleton))
        chain = (body.hips, *body.trunk, *body.neck, body.head)
        places = rest[list(chain)]
        lengths = np.linalg.norm(np.diff(places, axis=0), axis=-1)
        long = [0, *(k for k, length in enumerate(lengths, 1) if length > SHORT)]
        return cls(spine_shares(lengths, body.trunk_bones)[long], places[long])

    def direction(self, start: float, end: float) -> Array:
        """(3,) direction of a bone between two positions along the body, `start` and `end` (see `shares`).

        The bone is of another rig. If that rig has fewer joints, one of its bones may span several bones of
        this spine.
        """
        chest, first = int(np.searchsorted(self.shares, 1.0 - 1e-6)), self._bone(start)
        last = min(self._below(end), chest if end <= 1 else len(self.shares) - 1)
        return unit(self.points[max(last, first + 1)] - self.points[first])

    def end(self, start: float) -> float:
        """Position along the body at which the bone from `start` ends in this spine."""
        return float(self.shares[self._bone(start) + 1])

    @property
    def neck(self) -> Array:
        """(3,) direction from the chest to the next joint above: the neck, or the head if it has none."""
        chest = min(int(np.searchsorted(self.shares, 1.0 - 1e-6)), len(self.shares) - 2)
        return unit(self.points[chest + 1] - self.points[chest])

    @property
    def has_neck(self) -> bool:
        """Whether there is a point between chest and head."""
        return bool(((self.shares > 1.0 + 1e-6) & (self.shares < 2.0 - 1e-6)).any())

    def _bone(self, start: float) -> int:
        """Index of the point at which the bone from position `start` along the body begins."""
        chest = int(np.searchsorted(self.shares, 1.0 - 1e-6))
        return max(min(self._below(start), chest - 1 if start < 1 else len(self.shares) - 2), 0)

    def _below(self, share: float) -> int:
        """Index of the highest point that is at most REACH above the position `share` along the body."""
        return int(np.searchsorted(self.shares, share + REACH, side="right")) - 1


def spine_shares(lengths: Array, trunk: int) -> Array:
    """(N,) position of each joint along the body, where hips are at 0, chest at 1 and head at 2.

    lengths: (N-1,) of the bones from the hips through trunk and neck to the head. trunk: number of bones of
    the trunk, the last of which ends at the chest.
    """
    way = np.concatenate([[0.0], np.cumsum(lengths)])
    below, above = way[: trunk + 1], way[trunk:] - way[trunk]
    shares = np.concatenate(
        [below[:-1] / max(float(below[-1]), 1e-9), 1.0 + above / max(float(above[-1]), 1e-9)]
    )
    shares[0] = 0.0
    return shares
