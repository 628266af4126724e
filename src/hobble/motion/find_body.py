"""Finds the legs, arms, trunk and head of an unknown rig, from structure, motion and names.

A limb is one of two chains with bones of equal lengths that start at one joint and bend in the middle. The
legs point away from the joint that carries the arms, and they are the longer pair. Names say which side is
left. If they do not, up and forward do, in right-handed coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from hobble.core.quat import Array
from hobble.motion.body import SIDES, Body
from hobble.motion.names import is_end, limb_parts, part_of, side_of, side_of_pair
from hobble.motion.tree import above, common, path

SAMPLES = 150
ALIKE = 0.15  # relative difference of length that a bone and its counterpart may have
RIGID = 0.03  # relative change of the length between two joints that count as one bone
RATIOS = {"leg": (0.6, 1.6), "arm": (0.48, 1.6)}  # shank to thigh, forearm to upper arm
APART = {"leg": 0.2, "arm": 0.4}  # of hips to knees, of shoulders to elbows, which may be spread for balance
FEWEST = 3  # joints of a limb
LEAST = 0.15  # least length of a limb, relative to the size of the body
SWING = 10.0  # degrees: limbs that bend and stretch by more are surely limbs
AWAY = -0.2  # legs and trunk point apart if the cosine between them is below this
WORDS = {
    "leg": {"thigh", "shank", "foot", "ankle", "toe", "leg", "hip"},
    "arm": {"clavicle", "upperarm", "forearm", "hand", "wrist", "finger", "arm", "shoulder"},
}
LIMBS = {"leg": ("thigh", "shank", "foot"), "arm": ("upperarm", "forearm", "hand")}


class Doubt(Exception):
    """What is uncertain about a rig. why: in words. roles: those that are certain, role -> joint."""

    def __init__(self, why: str, roles: dict[str, int] | None = None) -> None:
        super().__init__(why)
        self.roles = roles or {}


class TwoFigures(Doubt):
    """A rig with more than one body."""


@dataclass(frozen=True)
class Found:
    """The body of a rig. sided: whether names distinguish left and right."""

    body: Body
    sided: bool


@dataclass(frozen=True)
class _Pair:
    """Two equal chains of joints below one joint, from the trunk outward, `sides` (a, b)."""

    hub: int
    chains: tuple[tuple[int, ...], tuple[int, ...]]
    length: float


def find_body(names: Sequence[str], parents: Sequence[int], positions: Array) -> Found:
    """Find the parts of a body.

    positions: (F, J, 3) in the world, any unit, any axes. Raises Doubt if the rig and the motion do not
    determine the parts.
    """
    rig = _Rig(tuple(names), tuple(parents), positions)
    pairs = rig.pairs()
    if len(pairs) < 2:
        raise Doubt("its joints do not contain two equal legs and two equal arms")
    legs, arms = rig.limbs(pairs)
    leg = [rig.joints_of(legs, "leg", k) for k in (0, 1)]
    arm = [rig.joints_of(arms, "arm", k) for k in (0, 1)]
    head, neck = rig.head(legs, arms)
    left_leg, sided = rig.left(legs, leg, leg, arm, head)
    left_arm = rig.left_arm(leg, left_leg, arm, arms)
    hips = common(parents, [leg[0][0], leg[1][0]])
    hips = parents[hips] if hips in (leg[0][0], leg[1][0]) else hips
    chest = arms.hub
    trunk = [j for j in path(parents, hips, chest) if j != hips and (j not in above(parents, hips))]
    ordered = {SIDES[0]: left_leg, SIDES[1]: 1 - left_leg}
    across = {SIDES[0]: left_arm, SIDES[1]: 1 - left_arm}
    body = Body(
        hips,
        tuple(trunk),
        neck,
        head,
        {s: (rig.clavicle(arms, k, arm[k][0]), *arm[k]) for s, k in across.items()},
        {s: (*leg[k], rig.toe(legs, k, leg[k][2])) for s, k in ordered.items()},
    )
    if other := _second(names, parents, positions, hips):
        raise TwoFigures(f"it holds two figures, {names[hips]} and {names[other]}")
    return Found(body, sided)


def _second(names: Sequence[str], parents: Sequence[int], positions: Array, hips: int) -> int | None:
    """The top joint of another figure beside the one with these hips, or None."""
    chain = above(parents, hips)
    for top in range(len(parents)):
        if parents[top] not in chain[1:] or top in chain:
            continue
        part = [j for j in range(len(parents)) if top in above(parents, j)]
        new = {old: i for i, old in enumerate(part)}
        try:
            find_body([names[j] for j in part], [new.get(parents[j], -1) for j in part], positions[:, part])
        except Doubt:
            continue
        return top
    return None


@dataclass(frozen=True)
class _Rig:
    names: tuple[str, ...]
    parents: tuple[int, ...]
    positions: Array = field(repr=False)

    @cached_property
    def at(self) -> Array:
        """(S, J, 3): a sample of frames that is large enough to see what moves."""
        every = np.unique(np.linspace(0, len(self.positions) - 1, SAMPLES).round().astype(int))
        return self.positions[every]

    @cached_property
    def lengths(self) -> Array:
        """(J,) length from each joint to its parent."""
        up = [max(p, 0) for p in self.parents]
        return np.median(np.linalg.norm(self.at - self.at[:, up], axis=-1), axis=0)

    @cached_property
    def size(self) -> float:
        """The largest extent of the body, in the file's unit."""
        return float(np.median(np.linalg.norm(np.ptp(self.at, axis=1), axis=-1)))

    @cached_property
    def children(self) -> list[list[int]]:
        out: list[list[int]] = [[] for _ in self.names]
        for j, p in enumerate(self.parents):
            if p >= 0:
                out[p].append(j)
        return out

    def alike(self, a: int, b: int) -> bool:
        """Whether two bones can be each other's counterparts."""
        sides = {side_of(self.names[a]), side_of(self.names[b])}
        if None not in sides and len(sides) == 1:
            return False
        longer = max(self.lengths[a], self.lengths[b])
        share = 2 * ALIKE if sides == set(SIDES) else ALIKE
        return bool(abs(self.lengths[a] - self.lengths[b]) <= share * longer + 0.01 * self.size)

    def match(self, a: int, b: int) -> tuple[float, tuple[int, ...], tuple[int, ...]]:
        """The longest equal chains of bones from a and b on: their length and joints."""
        best: tuple[float, tuple[int, ...], tuple[int, ...]] = (0.0, (), ())
        for c in self.children[a]:
            for d in self.children[b]:
                if self.alike(c, d):
                    found = self.match(c, d)
                    if found[0] > best[0] or not best[1]:
                        best = found
        own = float(min(self.lengths[a], self.lengths[b]))
        return own + best[0], (a, *best[1]), (b, *best[2])

    def pairs(self) -> list[_Pair]:
        """All pairs of chains that can be legs or arms."""
        out = []
        for hub, below in enumerate(self.children):
            for i, a in enumerate(below):
                for b in below[i + 1 :]:
                    if not self.alike(a, b):
                        continue
                    length, one, other = self.match(a, b)
                    length -= float(min(self.lengths[a], self.lengths[b]))
                    if length > LEAST * self.size and len(one) >= FEWEST:
                        out.append(_Pair(hub, (one, other), length))
        return out

    def limbs(self, pairs: list[_Pair]) -> tuple[_Pair, _Pair]:
        """The pair of legs and the pair of arms of the likeliest body."""
        known = {}
        for i, pair in enumerate(pairs):
            for kind in ("leg", "arm"):
                if (middle := self.segments(pair, kind)) is not None:
                    known[i, kind] = middle
        found = []
        for i, legs in enumerate(pairs):
            for k, arms in enumerate(pairs):
                if legs.hub == arms.hub or (i, "leg") not in known or (k, "arm") not in known:
                    continue
                if set(sum(legs.chains, ())) & set(sum(arms.chains, ())):
                    continue
                away = self._away(legs, known[i, "leg"], arms)
                if away > AWAY:
                    continue
                ratio = self._long(legs, known[i, "leg"]) / self._long(arms, known[k, "arm"])
                score = np.log(ratio) - away
                for pair, place, kind in ((legs, known[i, "leg"], "leg"), (arms, known[k, "arm"], "arm")):
                    score += self._named(pair, kind) + self._swing(pair, place)
                found.append((score, i, k))
        if not found:
            raise Doubt("the motion does not show which chains are legs and which are arms")
        _, i, k = max(found)
        return pairs[i], pairs[k]

    def _away(self, legs: _Pair, middle: tuple[int, int, int], arms: _Pair) -> float:
        """Mean cosine between the directions to the feet and to the arms' root; -1 for a standing body."""
        trunk = self.at[:, arms.hub] - self.at[:, legs.hub]
        feet = sum(self.at[:, chain[middle[2]]] for chain in legs.chains) / 2 - self.at[:, legs.hub]
        return float(np.mean(np.sum(_unit(trunk) * _unit(feet), axis=-1)))

    def _long(self, pair: _Pair, middle: tuple[int, int, int]) -> float:
        a, b, c = middle
        return (
            self._chord(pair.chains[0][a], pair.chains[0][b])[0]
            + self._chord(pair.chains[0][b], pair.chains[0][c])[0]
        )

    def _swing(self, pair: _Pair, middle: tuple[int, int, int]) -> float:
        """How much the limbs bend and stretch, 0 to 1. Hair, skirts and wings often keep one angle."""
        turns = [np.ptp(np.percentile(self._bend(chain, *middle), [3, 97])) for chain in pair.chains]
        return float(np.minimum(np.mean(turns) / SWING, 1.0))

    def _named(self, pair: _Pair, kind: str) -> float:
        """How strongly names suggest a kind of limb, -1 to 1."""
        parts = [part_of(self.names[j]) for chain in pair.chains for j in chain]
        other = "arm" if kind == "leg" else "leg"
        return (sum(p in WORDS[kind] for p in parts) - sum(p in WORDS[other] for p in parts)) / len(parts)

    def _chord(self, a: int, b: int) -> tuple[float, float]:
        """Median distance of two joints, and its relative change."""
        apart = np.linalg.norm(self.at[:, b] - self.at[:, a], axis=-1)
        middle = float(np.median(apart))
        low, high = np.percentile(apart, [3, 97])
        return middle, float(high - low) / max(middle, 1e-9)

    def segments(self, pair: _Pair, kind: str) -> tuple[int, int, int] | None:
        """Indices in the chains of hip, knee and ankle, or of shoulder, elbow and wrist.

        Names count if they give all three and the bones have the proportions of a body. Otherwise the two
        bones are the longest consecutive ones that keep their length and bend between. A chain of twist
        joints along a bone keeps its length from end to end.
        """
        chain = pair.chains[0]
        named = [limb_parts([self.names[j] for j in c]) for c in pair.chains]
        if all(set(LIMBS[kind]) <= set(found) for found in named):
            one, other = (tuple(found[part] for part in LIMBS[kind]) for found in named)
            if one == other and one[0] < one[1] < one[2] and self._fits(chain, one, kind):
                return one[0], one[1], one[2]
        best, where = 0.0, None
        for j in range(1, len(chain) - 1):
            for i in range(j):
                if self._moves(pair, i, j) or not self._apart(pair, i, j, kind):
                    continue
                for k in range(j + 1, len(chain)):
                    if not self._fits(chain, (i, j, k), kind):
                        continue
                    if self._moves(pair, j, k) or not self._bends(pair, i, j, k):
                        continue
                    total = self._chord(chain[i], chain[j])[0] + self._chord(chain[j], chain[k])[0]
                    if total > best * 1.0001:
                        best, where = total, (i, j, k)
                    break
        return where

    def _fits(self, chain: Sequence[int], places: Sequence[int], kind: str) -> bool:
        i, j, k = (chain[p] for p in places)
        upper, lower = self._chord(i, j)[0], self._chord(j, k)[0]
        low, high = RATIOS[kind]
        return min(upper, lower) > 0.04 * self.size and low <= lower / max(upper, 1e-9) <= high

    def _moves(self, pair: _Pair, i: int, j: int) -> bool:
        """Whether the distance between two joints of a chain changes, so that they are not one bone."""
        return any(self._chord(chain[i], chain[j])[1] > RIGID for chain in pair.chains)

    def _apart(self, pair: _Pair, i: int, j: int, kind: str) -> bool:
        """Whether the limbs begin apart, like shoulders and hips and unlike collarbones."""
        at = [
            np.median(np.linalg.norm(self.at[:, a] - self.at[:, b], axis=-1))
            for a, b in ((pair.chains[0][i], pair.chains[1][i]), (pair.chains[0][j], pair.chains[1][j]))
        ]
        return bool(at[0] >= APART[kind] * at[1])

    def _bends(self, pair: _Pair, i: int, j: int, k: int) -> bool:
        """Whether the limb bends there, by at least six degrees on either side."""
        for chain in pair.chains:
            angle = self._bend(chain, i, j, k)
            if np.percentile(angle, 97) > 6:
                return True
        return False

    def _bend(self, chain: Sequence[int], i: int, j: int, k: int) -> Array:
        """(S,) degrees between the bones before and after the middle one of three joints of a chain."""
        upper = _unit(self.at[:, chain[j]] - self.at[:, chain[i]])
        lower = _unit(self.at[:, chain[k]] - self.at[:, chain[j]])
        return np.degrees(np.arccos(np.clip(np.sum(upper * lower, axis=-1), -1, 1)))

    def joints_of(self, pair: _Pair, kind: str, k: int) -> tuple[int, int, int]:
        places = self.segments(pair, kind)
        assert places is not None
        a, b, c = places
        return pair.chains[k][a], pair.chains[k][b], pair.chains[k][c]

    def toe(self, pair: _Pair, k: int, heel: int) -> int | None:
        """The ball of the foot: the first joint a foot's length away from the ankle, or None."""
        chain = pair.chains[k]
        leg = pair.length
        after = chain[chain.index(heel) + 1 :]
        named = limb_parts([self.names[j] for j in chain]).get("toe")
        if named is not None and chain[named] in after and self._chord(heel, chain[named])[0] > 0.03 * leg:
            return chain[named]
        return next((j for j in after if self._chord(heel, j)[0] > 0.06 * leg), None)

    def clavicle(self, pair: _Pair, k: int, shoulder: int) -> int | None:
        """The joint between chest and shoulder that moves the shoulder, or None."""
        chain = pair.chains[k]
        before = chain[: chain.index(shoulder)]
        moving = [j for j in before if self._chord(j, shoulder)[0] > 0.01 * self.size]
        return moving[-1] if moving else None

    def head(self, legs: _Pair, arms: _Pair) -> tuple[int, tuple[int, ...]]:
        """The head, and the joints between it and the chest."""
        limbs = set(sum(legs.chains, ())) | set(sum(arms.chains, ()))
        named = [
            j
            for j, n in enumerate(self.names)
            if part_of(n) == "head" and not is_end(n) and side_of(n) is None
        ]
        named = [
            j for j in named if arms.hub in above(self.parents, j) and not limbs & set(above(self.parents, j))
        ]
        spine = path(self.parents, legs.hub, arms.hub)
        if named:
            head = min(named, key=lambda j: len(above(self.parents, j)))
        else:
            head = self._highest(legs, arms, limbs)
        way = path(self.parents, arms.hub, head)[1:-1]
        return head, tuple(j for j in way if j not in spine)

    def _highest(self, legs: _Pair, arms: _Pair, limbs: set[int]) -> int:
        """The end of the chain that goes furthest from the trunk.

        Joints that only mark the head's end do not count.
        """
        trunk = _unit(self.at[:, arms.hub] - self.at[:, legs.hub])
        base = sum(self.at[:, chain[0]] for chain in arms.chains) / 2

        def height(j: int) -> float:
            return float(np.mean(np.sum((self.at[:, j] - base) * trunk, axis=-1)))

        below = [j for j in range(len(self.names)) if arms.hub in above(self.parents, j)[1:]]
        below = [j for j in below if not limbs & set(above(self.parents, j))]
        # Hair, ears and wings have a left and a right, and a head has not.
        pairs = [set(sum(pair.chains, ())) for pair in self.pairs()]
        twins = set().union(*(pair for pair in pairs if not pair & limbs))
        single = [j for j in below if not twins & set(above(self.parents, j)) and not side_of(self.names[j])]
        below = single or below
        if not below:
            raise Doubt("there is no joint for the head above the arms")
        top = max(below, key=height)
        chain = [j for j in above(self.parents, top) if j in below][::-1]
        leg = self._chord(legs.chains[0][0], legs.chains[0][-1])[0]
        while len(chain) > 1 and (
            height(chain[-1]) > 0.42 * leg or self.lengths[chain[-1]] < 0.01 * self.size
        ):
            chain.pop()
        return chain[-1]

    def left(
        self, pair: _Pair, leg: list[tuple[int, int, int]], legs: list, arm: list, head: int
    ) -> tuple[int, bool]:
        """Which of the two legs is the left one, and whether names say so."""
        named = self.named_sides(pair)
        if named[0] * named[1] < 0:
            return (0 if named[0] > 0 else 1), True
        up = _unit(self.at[:, head] - sum(self.at[:, j[2]] for j in leg) / 2)
        ahead = self._ahead(pair, leg)
        across = self.at[:, leg[0][0]] - self.at[:, leg[1][0]]
        turn = float(np.mean(np.sum(np.cross(up, ahead) * _unit(across), axis=-1)))
        if abs(turn) < 0.3:
            raise Doubt("neither names nor feet and knees show which side is left")
        return (0 if turn > 0 else 1), False

    def named_sides(self, pair: _Pair) -> tuple[int, int]:
        """For both chains how many more joints have left than right names."""
        votes = []
        for chain, across in (pair.chains, pair.chains[::-1]):
            sides = [side_of(self.names[j]) for j in chain]
            if not any(sides):
                sides = [
                    side_of_pair(self.names[a], self.names[b]) for a, b in zip(chain, across, strict=False)
                ]
            votes.append(sides.count("left") - sides.count("right"))
        return votes[0], votes[1]

    def _ahead(self, pair: _Pair, leg: list[tuple[int, int, int]]) -> Array:
        """(S, 3) direction of the feet and, with less weight, of the knees."""
        out = np.zeros((len(self.at), 3))
        for k, (hip, knee, heel) in enumerate(leg):
            toe = self.toe(pair, k, heel)
            line = self.at[:, heel] - self.at[:, hip]
            share = np.sum((self.at[:, knee] - self.at[:, hip]) * line, axis=-1, keepdims=True)
            bend = self.at[:, knee] - self.at[:, hip] - line * share / np.sum(line**2, axis=-1, keepdims=True)
            out += bend
            if toe is not None:
                out += 3 * (self.at[:, toe] - self.at[:, heel])
        return _unit(out)

    def left_arm(
        self, leg: list[tuple[int, int, int]], left: int, arm: list[tuple[int, int, int]], pair: _Pair
    ) -> int:
        """Which of the two arms is the left one, on the side of the left leg."""
        across = self.at[:, leg[left][0]] - self.at[:, leg[1 - left][0]]
        arms = self.at[:, arm[0][0]] - self.at[:, arm[1][0]]
        side = float(np.mean(np.sum(_unit(across) * _unit(arms), axis=-1)))
        named = self.named_sides(pair)
        place = 0 if side > 0 else 1
        if abs(side) < 0.2 or (named[0] * named[1] < 0 and (named[0] > 0) != (place == 0)):
            raise Doubt("its left arm and its left leg are not on the same side")
        return place


def _unit(v: Array) -> Array:
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9)
