"""Measures an unknown rig in motion: how long its bones are, how they bend, and which chains are equal.

Two equal chains of bones may be the legs or the arms. Other modules decide which pairs of chains are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from hobble.core.quat import Array
from hobble.motion.body import SIDES
from hobble.motion.names import are_twins, side_of
from hobble.motion.orient import unit_vectors

SAMPLES = 150  # at most this many frames of the clip are looked at
# The lengths of a bone and its counterpart differ by at most this share. If names say left and right, twice
# as much is allowed.
ALIKE = 0.15
FEWEST_JOINTS = 3  # a limb has at least this many joints
# A limb is longer than this share of `MovingRig.size`. The share is small, because the size includes wings
# and swords.
LEAST_LENGTH = 0.1


@dataclass(frozen=True)
class LimbPair:
    """Two equal chains of joints, which may be two legs or two arms.

    hub: the joint from which both chains hang. chains: the joints of each chain, from the trunk outward.
    length: sum of the bones of a chain, from its first joint to its last.
    """

    hub: int
    chains: tuple[tuple[int, ...], tuple[int, ...]]
    length: float


@dataclass(frozen=True)
class MovingRig:
    """The joints of a rig in motion.

    parents: index of each joint's parent, -1 for the root. positions: (F, J, 3) in the world, in any unit and
    along any axes.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: Array = field(repr=False)

    @cached_property
    def sampled_positions(self) -> Array:
        """(S, J, 3) positions in S frames, spread evenly over the clip."""
        sampled = np.unique(np.linspace(0, len(self.positions) - 1, SAMPLES).round().astype(int))
        return self.positions[sampled]

    @cached_property
    def lengths(self) -> Array:
        """(J,) distance of each joint from its parent (median over the sampled frames); 0 for the root."""
        parents = [max(p, 0) for p in self.parents]
        return np.median(
            np.linalg.norm(self.sampled_positions - self.sampled_positions[:, parents], axis=-1), axis=0
        )

    @cached_property
    def size(self) -> float:
        """The diagonal of the box around all joints (median over the sampled frames)."""
        return float(np.median(np.linalg.norm(np.ptp(self.sampled_positions, axis=1), axis=-1)))

    @cached_property
    def children(self) -> list[list[int]]:
        """The indices of each joint's children."""
        out: list[list[int]] = [[] for _ in self.names]
        for j, p in enumerate(self.parents):
            if p >= 0:
                out[p].append(j)
        return out

    def can_be_counterparts(self, a: int, b: int) -> bool:
        """Whether the bones that end at joints `a` and `b` can be counterparts on the left and on the right.

        Their names must not say the same side, and their lengths must be nearly equal.
        """
        sides = {side_of(self.names[a]), side_of(self.names[b])}
        if None not in sides and len(sides) == 1:
            return False
        longer = max(self.lengths[a], self.lengths[b])
        share = 2 * ALIKE if sides == set(SIDES) else ALIKE
        return bool(abs(self.lengths[a] - self.lengths[b]) <= share * longer + 0.01 * self.size)

    def longest_equal_chains(self, a: int, b: int) -> tuple[float, tuple[int, ...], tuple[int, ...]]:
        """The longest equal chains of bones that start with the bones that end at joints `a` and `b`.

        Returns the length of a chain (of the shorter bones, if two are unequal), the joints of the chain from
        `a` on, and the joints of the chain from `b` on.
        """
        best: tuple[float, tuple[int, ...], tuple[int, ...]] = (0.0, (), ())
        for c in self.children[a]:
            for d in self.children[b]:
                if self.can_be_counterparts(c, d) and self._names_allow_counterparts(c, d):
                    found = self.longest_equal_chains(c, d)
                    if found[0] > best[0] or not best[1]:
                        best = found
        own = float(min(self.lengths[a], self.lengths[b]))
        return own + best[0], (a, *best[1]), (b, *best[2])

    def _names_allow_counterparts(self, a: int, b: int) -> bool:
        """Whether the names of two joints allow that they are counterparts.

        If names say which joint is the counterpart of one of them (as in LeftToe2 and RightToe2), no other
        joint can be it.
        """
        # The joints that can be the counterpart of a, and of b.
        across = {a: self.children[self.parents[b]], b: self.children[self.parents[a]]}
        for joint, other in ((a, b), (b, a)):
            twins = [j for j in across[joint] if j != joint and are_twins(self.names[joint], self.names[j])]
            if twins and other not in twins:
                return False
        return True

    def limb_pairs(self) -> list[LimbPair]:
        """All pairs of chains that are long enough and have enough joints to be legs or arms."""
        out = []
        for hub, below in enumerate(self.children):
            for i, a in enumerate(below):
                for b in below[i + 1 :]:
                    if not self.can_be_counterparts(a, b) or not self._names_allow_counterparts(a, b):
                        continue
                    length, one, other = self.longest_equal_chains(a, b)
                    # Without the bone from the hub to the first joint.
                    length -= float(min(self.lengths[a], self.lengths[b]))
                    if length > LEAST_LENGTH * self.size and len(one) >= FEWEST_JOINTS:
                        out.append(LimbPair(hub, (one, other), length))
        return out

    def distance_and_variation(self, a: int, b: int) -> tuple[float, float]:
        """The median distance of joints `a` and `b`, and by how much the distance varies.

        The second value is the range from the 3rd to the 97th percentile, as a share of the median.
        """
        apart = np.linalg.norm(self.sampled_positions[:, b] - self.sampled_positions[:, a], axis=-1)
        middle = float(np.median(apart))
        low, high = np.percentile(apart, [3, 97])
        return middle, float(high - low) / max(middle, 1e-9)

    def bend_degrees(self, chain: Sequence[int], i: int, j: int, k: int) -> Array:
        """(S,) degrees by which a chain bends at its joint j: 0 if joints i, j and k are in line.

        i, j, k: indices in `chain`.
        """
        upper = unit_vectors(self.sampled_positions[:, chain[j]] - self.sampled_positions[:, chain[i]])
        lower = unit_vectors(self.sampled_positions[:, chain[k]] - self.sampled_positions[:, chain[j]])
        return np.degrees(np.arccos(np.clip(np.sum(upper * lower, axis=-1), -1, 1)))
