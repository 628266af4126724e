"""Measures an unknown rig in motion: lengths of bones, bends, and pairs of equal chains of bones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from hobble.core.quat import Array
from hobble.motion.body import SIDES
from hobble.motion.names import are_twins, side_of
from hobble.motion.orient import unit

SAMPLES = 150  # at most this many frames of the clip are looked at
ALIKE = 0.15  # largest relative difference of length between a bone and its counterpart
FEWEST = 3  # least number of joints of a limb
LEAST = 0.1  # least length of a limb, as a share of `MovingRig.size`, which includes wings and swords


@dataclass(frozen=True)
class LimbPair:
    """Two equal chains of joints below joint `hub`, from the trunk outward. length: of each chain."""

    hub: int
    chains: tuple[tuple[int, ...], tuple[int, ...]]
    length: float


@dataclass(frozen=True)
class MovingRig:
    """The joints of a rig in motion. positions: (F, J, 3) in the world, in any unit and axes."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: Array = field(repr=False)

    @cached_property
    def at(self) -> Array:
        """(S, J, 3) positions in a sample of frames."""
        sampled = np.unique(np.linspace(0, len(self.positions) - 1, SAMPLES).round().astype(int))
        return self.positions[sampled]

    @cached_property
    def lengths(self) -> Array:
        """(J,) distance of each joint from its parent."""
        up = [max(p, 0) for p in self.parents]
        return np.median(np.linalg.norm(self.at - self.at[:, up], axis=-1), axis=0)

    @cached_property
    def size(self) -> float:
        """The diagonal of the box around all joints, in the file's unit (median over the sample)."""
        return float(np.median(np.linalg.norm(np.ptp(self.at, axis=1), axis=-1)))

    @cached_property
    def children(self) -> list[list[int]]:
        """The child joints of each joint."""
        out: list[list[int]] = [[] for _ in self.names]
        for j, p in enumerate(self.parents):
            if p >= 0:
                out[p].append(j)
        return out

    def alike(self, a: int, b: int) -> bool:
        """Whether the bones that end at joints `a` and `b` can be counterparts, by name and length."""
        sides = {side_of(self.names[a]), side_of(self.names[b])}
        if None not in sides and len(sides) == 1:
            return False
        longer = max(self.lengths[a], self.lengths[b])
        share = 2 * ALIKE if sides == set(SIDES) else ALIKE
        return bool(abs(self.lengths[a] - self.lengths[b]) <= share * longer + 0.01 * self.size)

    def match(self, a: int, b: int) -> tuple[float, tuple[int, ...], tuple[int, ...]]:
        """The longest equal chains of bones that begin with a and b: their length, and the joints of each."""
        best: tuple[float, tuple[int, ...], tuple[int, ...]] = (0.0, (), ())
        for c in self.children[a]:
            for d in self.children[b]:
                if self.alike(c, d) and self._named_alike(c, d):
                    found = self.match(c, d)
                    if found[0] > best[0] or not best[1]:
                        best = found
        own = float(min(self.lengths[a], self.lengths[b]))
        return own + best[0], (a, *best[1]), (b, *best[2])

    def _named_alike(self, a: int, b: int) -> bool:
        """Whether names allow that two joints are counterparts. A counterpart by name excludes all others."""
        across = {a: self.children[self.parents[b]], b: self.children[self.parents[a]]}
        for one, other in ((a, b), (b, a)):
            twins = [j for j in across[one] if j != one and are_twins(self.names[one], self.names[j])]
            if twins and other not in twins:
                return False
        return True

    def pairs(self) -> list[LimbPair]:
        """All pairs of chains that can be legs or arms."""
        out = []
        for hub, below in enumerate(self.children):
            for i, a in enumerate(below):
                for b in below[i + 1 :]:
                    if not self.alike(a, b) or not self._named_alike(a, b):
                        continue
                    length, one, other = self.match(a, b)
                    length -= float(min(self.lengths[a], self.lengths[b]))
                    if length > LEAST * self.size and len(one) >= FEWEST:
                        out.append(LimbPair(hub, (one, other), length))
        return out

    def chord(self, a: int, b: int) -> tuple[float, float]:
        """Median distance of two joints, and by how much it varies, as a share of the median."""
        apart = np.linalg.norm(self.at[:, b] - self.at[:, a], axis=-1)
        middle = float(np.median(apart))
        low, high = np.percentile(apart, [3, 97])
        return middle, float(high - low) / max(middle, 1e-9)

    def bend(self, chain: Sequence[int], i: int, j: int, k: int) -> Array:
        """(S,) degrees between the lines i to j and j to k. i, j, k: indices in `chain`."""
        upper = unit(self.at[:, chain[j]] - self.at[:, chain[i]])
        lower = unit(self.at[:, chain[k]] - self.at[:, chain[j]])
        return np.degrees(np.arccos(np.clip(np.sum(upper * lower, axis=-1), -1, 1)))
