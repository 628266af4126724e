"""Directions of the bones of trunk and neck in a standing rest pose."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

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
    """Directions of the bones of trunk and neck in a rest pose that stands facing +Z.

    shares: (N,) where the bones begin between hips (0) and chest (1). axes: (N, 3). neck: (3,) to the head.
    """

    shares: Array
    axes: Array
    neck: Array

    @classmethod
    def of(cls, skeleton: Skeleton, body: Body) -> Spine:
        """The spine of a skeleton with a standing rest pose. Converted motion gets the same directions."""
        rest = quat.rotate(quat.inv(rest_frame(skeleton)), rest_positions(skeleton))
        chain = (body.hips, *body.trunk, *body.neck, body.head)
        long = [j for k, j in enumerate(chain[1:]) if np.linalg.norm(rest[j] - rest[chain[k]]) > SHORT]
        long = [body.hips, *long]
        way = np.concatenate(
            [[0.0], np.cumsum([np.linalg.norm(rest[b] - rest[a]) for a, b in pairwise(long)])]
        )
        axes = np.array([unit(rest[b] - rest[a]) for a, b in pairwise(long)])
        chest = max(
            float(np.linalg.norm(np.diff(rest[list(chain[: len(body.trunk) + 1])], axis=0), axis=-1).sum()),
            1e-9,
        )
        below = way[:-1] <= chest * 1.001
        return cls(way[:-1][below] / chest, axes[below], axes[-1])

    def at(self, share: float) -> Array:
        """(3,) direction of the bone that begins nearest below a share, or slightly above it."""
        return self.axes[max(0, int(np.searchsorted(self.shares, share + REACH, side="right")) - 1)]
