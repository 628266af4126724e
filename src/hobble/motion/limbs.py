"""Finds the legs, arms, trunk and head of an unknown rig, from structure, motion and names.

Limbs come in pairs: two chains of joints that start at the same joint, the hub, and bend in the middle. Each
bone of one chain is as long as its counterpart in the other. The legs point away from the joint that carries
the arms, and they are the longer pair. Names show which side is left. Where they do not, the place of the
head and the direction of feet and knees show it, but this is right only in right-handed coordinates.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import common_ancestor, path_between, path_to_root
from hobble.motion.axes import bend_direction, degrees_between, unit
from hobble.motion.body import SIDES, Body, middle
from hobble.motion.names import are_twins, is_end, kind_score, limb_parts, part_of, side_of, side_of_pair

SAMPLES = 150  # at most this many frames of the clip are looked at
# The lengths of a bone and its counterpart differ by at most this share. If names say left and right, twice
# as much is allowed.
ALIKE = 0.15
FEWEST_JOINTS = 3  # a limb has at least this many joints
# A limb is longer than this share of `MovingRig.size`. The share is small, because the size includes wings
# and swords.
LEAST_LENGTH = 0.1
RIGID = 0.03  # two joints can be the ends of one bone if their distance varies by at most this share
RATIOS = {"leg": (0.6, 1.6), "arm": (0.48, 1.6)}  # range of shank / thigh, and of forearm / upper arm
# Least distance of the two hips as a share of the distance of the knees, and of the two shoulders as a share
# of the distance of the elbows. The shares are small, because knees and elbows may be spread for balance.
APART = {"leg": 0.2, "arm": 0.4}
SWING = 10.0  # degrees: chains whose bend varies by this much or more get the full score in `_score`
# Largest mean cosine of the angle between legs and trunk, both seen from the hips. It is -1 if they point in
# opposite directions, as in a standing body.
AWAY = -0.2
# Parts of a limb, from the trunk outward. Each is the name of the joint where the part begins.
PARTS = {"leg": ("thigh", "shank", "foot"), "arm": ("upperarm", "forearm", "hand")}
# A figure counts as four-legged if three things hold in more than the share NEARLY_ALL of the frames:
# - Hips and feet are further apart than STRETCHED, in leg lengths. In a person who crawls on the knees they
#   are nearer.
# - The hands are further below the hips than the share REACH of the distance from hips to feet.
# - The cosine of the angle between the directions from the hips to the chest and from the hips to the feet is
#   larger than LEVEL. It is -1 in a standing person, and 0 if the trunk is level.
STRETCHED, REACH, LEVEL, NEARLY_ALL = 0.7, 0.6, -0.5, 0.9
# If its arms are longer than the share LONG_ARMS of its legs, as front legs are, more than the share
# SOMETIMES of the frames is enough. People's arms are .54 to .7 leg lengths long.
LONG_ARMS, SOMETIMES = 0.85, 0.2

Triple = tuple[int, int, int]


class Doubt(Exception):
    """It is uncertain which joints of a rig are which parts of the body."""


@dataclass(frozen=True)
class Limbs:
    """Two equal chains of joints, which may be two legs or two arms.

    hub: the joint from which both chains hang. chains: the joints of each chain, from the trunk outward.
    length: sum of the bones of a chain, from its first joint to its last. joints: for each chain hip, knee
    and ankle, or shoulder, elbow and wrist, as soon as they are known.
    """

    hub: int
    chains: tuple[tuple[int, ...], tuple[int, ...]]
    length: float
    joints: tuple[Triple, ...] = ()

    @property
    def all_joints(self) -> set[int]:
        """The joints of both chains."""
        return set(sum(self.chains, ()))


@dataclass(frozen=True)
class MovingRig:
    """The joints of a rig in motion.

    parents: index of each joint's parent, -1 for the root. positions: (S, J, 3) in the world in some frames,
    in any unit and along any axes.
    """

    names: Sequence[str]
    parents: Sequence[int]
    positions: Array = field(repr=False)
    # (joint, parent) -> result of `_twins_below`: each is asked for once for every child of `parent`.
    _twins: dict[tuple[int, int], list[int]] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def lengths(self) -> Array:
        """(J,) distance of each joint from its parent (median over the frames); 0 for the root."""
        parents = [max(p, 0) for p in self.parents]
        return np.median(np.linalg.norm(self.positions - self.positions[:, parents], axis=-1), axis=0)

    @cached_property
    def size(self) -> float:
        """The diagonal of the box around all joints (median over the frames)."""
        return float(np.median(np.linalg.norm(np.ptp(self.positions, axis=1), axis=-1)))

    @cached_property
    def children(self) -> list[list[int]]:
        """The indices of each joint's children."""
        out: list[list[int]] = [[] for _ in self.parents]
        for j, p in enumerate(self.parents):
            if p >= 0:
                out[p].append(j)
        return out

    def vectors(self, a: int, b: int) -> Array:
        """(S, 3) from joint `a` to joint `b`."""
        return self.positions[:, b] - self.positions[:, a]

    def distance(self, a: int, b: int) -> float:
        """The median distance of joints `a` and `b`."""
        return float(np.median(np.linalg.norm(self.vectors(a, b), axis=-1)))

    def keeps_distance(self, a: int, b: int) -> bool:
        """Whether one bone can connect joints `a` and `b`: their distance hardly varies."""
        low, high = np.percentile(np.linalg.norm(self.vectors(a, b), axis=-1), [3, 97])
        return bool(high - low <= RIGID * max(self.distance(a, b), 1e-9))

    def bend_degrees(self, i: int, j: int, k: int) -> Array:
        """(S,) degrees by which a limb bends at joint j: 0 if joints i, j and k are in line."""
        return degrees_between(self.vectors(i, j), self.vectors(j, k))

    def are_counterparts(self, a: int, b: int) -> bool:
        """Whether the bones that end at joints `a` and `b` can be counterparts on the left and on the right.

        Their lengths must be nearly equal, and their names must not say the same side. If names say which
        joint is the counterpart of one of them (as in LeftToe2 and RightToe2), no other joint can be it.
        """
        sides = {side_of(self.names[a]), side_of(self.names[b])}
        if None not in sides and len(sides) == 1:
            return False
        longer, share = max(self.lengths[a], self.lengths[b]), 2 * ALIKE if sides == set(SIDES) else ALIKE
        if abs(self.lengths[a] - self.lengths[b]) > share * longer + 0.01 * self.size:
            return False
        for joint, other in ((a, b), (b, a)):
            twins = self._twins_below(joint, self.parents[other])
            if twins and other not in twins:
                return False
        return True

    def _twins_below(self, joint: int, parent: int) -> list[int]:
        """Those children of `parent` whose names say that they are the counterpart of `joint`."""
        if (joint, parent) not in self._twins:
            name = self.names[joint]
            below = [j for j in self.children[parent] if j != joint and are_twins(name, self.names[j])]
            self._twins[joint, parent] = below
        return self._twins[joint, parent]

    def equal_chains(self, a: int, b: int) -> tuple[float, tuple[int, ...], tuple[int, ...]]:
        """The longest equal chains of bones that start with the bones that end at joints `a` and `b`.

        Returns the length of a chain (of the shorter bones, if two are unequal), the joints of the chain from
        `a` on, and the joints of the chain from `b` on.
        """
        below = [(c, d) for c in self.children[a] for d in self.children[b] if self.are_counterparts(c, d)]
        # Of equally long chains, the first counts.
        chains = (self.equal_chains(c, d) for c, d in below)
        longest = max(chains, key=lambda found: found[0], default=(0.0, (), ()))
        return float(min(self.lengths[a], self.lengths[b])) + longest[0], (a, *longest[1]), (b, *longest[2])

    @cached_property
    def limb_pairs(self) -> list[Limbs]:
        """All pairs of chains that are long enough and have enough joints to be legs or arms."""
        out = []
        for hub, below in enumerate(self.children):
            for a, b in ((a, b) for i, a in enumerate(below) for b in below[i + 1 :]):
                if self.are_counterparts(a, b):
                    length, one, other = self.equal_chains(a, b)
                    length -= float(min(self.lengths[a], self.lengths[b]))  # the bone from the hub
                    if length > LEAST_LENGTH * self.size and len(one) >= FEWEST_JOINTS:
                        out.append(Limbs(hub, (one, other), length))
        return out


def find_body(names: Sequence[str], parents: Sequence[int], positions: Array) -> tuple[Body, bool]:
    """Find the parts of a body. Also says whether the names of its joints distinguish left and right.

    names, parents: of the J joints; the root's parent is -1. positions: (F, J, 3) of the joints in the world,
    in any unit and along any axes. Raises Doubt if there is a second body, or if the rig and the motion do
    not determine the parts.
    """
    sampled = np.unique(np.linspace(0, len(positions) - 1, SAMPLES).round().astype(int))
    rig = MovingRig(names, parents, positions[sampled])
    legs, arms = _find_limbs(rig)
    head, neck = _find_head(rig, legs, arms)
    legs, sided = _left_leg_first(rig, legs, head)
    arms = _left_arm_first(rig, legs, arms)
    # The body's hips are the joint from which both hip joints (the tops of the thighs) hang.
    tops = legs.joints[0][0], legs.joints[1][0]
    hips = common_ancestor(parents, tops)
    hips = parents[hips] if hips in tops else hips
    trunk = [j for j in path_between(parents, hips, arms.hub) if j not in path_to_root(parents, hips)]
    if len(trunk) > 1 and part_of(names[trunk[-1]]) == "neck" and head != trunk[-1]:
        neck = (trunk.pop(), *neck)  # in rigs of 3ds Max the neck carries the arms
    if other := _find_second_figure(rig, hips):
        raise Doubt(f"it has two figures, {names[hips]} and {names[other]}. Export each figure on its own")
    of_arms = {side: (_find_clavicle(rig, arms, k), *arms.joints[k]) for k, side in enumerate(SIDES)}
    of_legs = {side: (*legs.joints[k], _find_toe(rig, legs, k)) for k, side in enumerate(SIDES)}
    return Body(hips, tuple(trunk), neck, head, of_arms, of_legs), sided


def _find_second_figure(rig: MovingRig, hips: int) -> int | None:
    """The top joint of a second figure in the file, or None.

    hips: index of the first figure's hips. A second figure hangs from a joint above them, on another branch.
    """
    above_hips = path_to_root(rig.parents, hips)
    for top in (j for joint in above_hips[1:] for j in rig.children[joint] if j not in above_hips):
        branch = [j for j in range(len(rig.parents)) if top in path_to_root(rig.parents, j)]
        new = {old: i for i, old in enumerate(branch)}  # joint -> its index in the branch
        parents = [new.get(rig.parents[j], -1) for j in branch]
        try:
            find_body([rig.names[j] for j in branch], parents, rig.positions[:, branch])
        except Doubt:
            continue
        return top
    return None


def _find_limbs(rig: MovingRig) -> tuple[Limbs, Limbs]:
    """The legs and the arms of the likeliest body. Raises Doubt if no two pairs of chains can be them."""
    pairs = rig.limb_pairs
    if len(pairs) < 2:
        raise Doubt("its joints do not contain two equal legs and two equal arms")
    all_legs, all_arms = (
        [replace(pair, joints=joints) for pair in pairs if (joints := _limb_joints(rig, pair, kind))]
        for kind in ("leg", "arm")
    )
    best: tuple[float, Limbs, Limbs] | None = None
    for legs in all_legs:
        for arms in all_arms:
            if legs.hub == arms.hub or legs.all_joints & arms.all_joints:
                continue
            away = _legs_along_trunk(rig, legs, arms)
            if away > AWAY:
                continue
            # Legs are longer than arms, and point away from the trunk.
            score = np.log(_limb_length(rig, legs) / _limb_length(rig, arms)) - away
            score += _score(rig, legs, "leg")
            score += _score(rig, arms, "arm")
            if best is None or score >= best[0]:
                best = score, legs, arms
    if best is None:
        raise Doubt("the motion does not show which chains are legs and which are arms")
    return best[1], best[2]


def _legs_along_trunk(rig: MovingRig, legs: Limbs, arms: Limbs) -> float:
    """Mean cosine of the angle between legs and trunk, both seen from the hips: -1 for a standing body."""
    feet = sum(rig.positions[:, joints[2]] for joints in legs.joints) / 2 - rig.positions[:, legs.hub]
    return float(np.mean(np.sum(unit(rig.vectors(legs.hub, arms.hub)) * unit(feet), axis=-1)))


def _limb_length(rig: MovingRig, limbs: Limbs) -> float:
    """Length of the two bones of the first limb of a pair."""
    a, b, c = limbs.joints[0]
    return rig.distance(a, b) + rig.distance(b, c)


def _score(rig: MovingRig, limbs: Limbs, kind: str) -> float:
    """Score from -1 to 2 for how much two limbs are like legs or arms, by their names and their motion.

    kind: "leg" or "arm". Limbs bend and stretch, while hair, skirts and wings often keep one angle.
    """
    ranges = [np.ptp(np.percentile(rig.bend_degrees(*joints), [3, 97])) for joints in limbs.joints]
    by_name = kind_score([rig.names[j] for chain in limbs.chains for j in chain], kind)
    return by_name + float(np.minimum(np.mean(ranges) / SWING, 1.0))


def _limb_joints(rig: MovingRig, pair: Limbs, kind: str) -> tuple[Triple, ...]:
    """Hip, knee and ankle, or shoulder, elbow and wrist, of both chains; empty if the pair cannot be this.

    kind: "leg" or "arm". Names decide if they tell all three joints and the two bones between these have the
    proportions of a body. Otherwise the two bones are the longest consecutive ones that keep their lengths
    and have a bend between them. A bone may consist of several joints in line (twist joints): its length is
    the distance of the first and the last.
    """
    pair = _without_hub_joints(rig, pair)
    chain = pair.chains[0]
    named = [limb_parts([rig.names[j] for j in c]) for c in pair.chains]
    if all(set(PARTS[kind]) <= set(found) for found in named):
        i, j, k = (named[0][part] for part in PARTS[kind])
        same = (i, j, k) == tuple(named[1][part] for part in PARTS[kind])
        if same and i < j < k and _has_proportions(rig, chain[i], chain[j], chain[k], kind):
            return _at(pair, i, j, k)
    best, where = 0.0, tuple[Triple, ...]()
    for j in range(1, len(chain) - 1):
        for i in range(j):
            if not _can_be_upper_bone(rig, pair, i, j, kind):
                continue
            for k in range(j + 1, len(chain)):
                limbs = _at(pair, i, j, k)
                if (
                    _has_proportions(rig, *limbs[0], kind)
                    and all(rig.keeps_distance(b, c) for _, b, c in limbs)
                    and any(np.percentile(rig.bend_degrees(*limb), 97) > 6 for limb in limbs)
                ):
                    total = rig.distance(chain[i], chain[j]) + rig.distance(chain[j], chain[k])
                    if total > best * 1.0001:  # of equal lengths the first counts, whatever their rounding
                        best, where = total, limbs
                    break  # the lower bone ends at the first joint that fits
    return where


def _without_hub_joints(rig: MovingRig, pair: Limbs) -> Limbs:
    """The pair without the first joints of both chains that lie at the same place, as LHipJoint and RHipJoint
    of CMU do. A thigh or an upper arm begins on its own side of the body."""
    one, other = pair.chains
    pairs = enumerate(zip(one, other, strict=True))
    first = next((i for i, (a, b) in pairs if rig.distance(a, b) > 0.01 * rig.size), 0)
    return replace(pair, chains=(one[first:], other[first:]))


def _at(pair: Limbs, i: int, j: int, k: int) -> tuple[Triple, ...]:
    """The joints of both chains at three indices."""
    return tuple((chain[i], chain[j], chain[k]) for chain in pair.chains)


def _has_proportions(rig: MovingRig, i: int, j: int, k: int, kind: str) -> bool:
    """Whether the bones between three joints have the proportions of a leg or an arm, and are not tiny."""
    upper, lower = rig.distance(i, j), rig.distance(j, k)
    low, high = RATIOS[kind]
    return min(upper, lower) > 0.03 * rig.size and low <= lower / max(upper, 1e-9) <= high


def _can_be_upper_bone(rig: MovingRig, pair: Limbs, i: int, j: int, kind: str) -> bool:
    """Whether thighs or upper arms can lie between the joints i and j (indices) of both chains.

    They keep their length and begin apart from each other, as at the shoulders, not at the collarbones.
    """
    one, other = pair.chains
    if not all(rig.keeps_distance(chain[i], chain[j]) for chain in pair.chains):
        return False
    return rig.distance(one[i], other[i]) >= APART[kind] * rig.distance(one[j], other[j])


def _find_toe(rig: MovingRig, legs: Limbs, k: int) -> int | None:
    """The joint at the ball of a foot, or None if the rig has none. k: which of the legs, 0 or 1.

    It is the joint that is named as toe, else the first joint that is clearly away from the ankle.
    """
    chain, heel = legs.chains[k], legs.joints[k][2]
    after_heel = chain[chain.index(heel) + 1 :]

    def away(joints: Sequence[int], share: float) -> int | None:
        return next((j for j in joints if rig.distance(heel, j) > share * legs.length), None)

    place = limb_parts([rig.names[j] for j in chain]).get("toe")
    named = None if place is None or chain[place] not in after_heel else away([chain[place]], 0.03)
    found = away(after_heel, 0.06) if named is None else named
    if named is None and found is not None and part_of(rig.names[found]) == "ankle":
        # A second joint is named as ankle: this chain goes to the back of the heel, another one to the toe.
        return away([j for j in rig.children[heel] if part_of(rig.names[j]) == "toe"], 0.03)
    return found


def _find_clavicle(rig: MovingRig, arms: Limbs, k: int) -> int | None:
    """The joint between chest and shoulder that moves the shoulder, or None if there is none.

    A joint at the same place as the shoulder does not count. k: which of the arms, 0 or 1.
    """
    chain, shoulder = arms.chains[k], arms.joints[k][0]
    before = chain[: chain.index(shoulder)]
    return next((j for j in reversed(before) if rig.distance(j, shoulder) > 0.01 * rig.size), None)


def _find_head(rig: MovingRig, legs: Limbs, arms: Limbs) -> tuple[int, tuple[int, ...]]:
    """The index of the head, and those of the neck's joints.

    The neck's joints lie between the joint that carries the arms and the head. Raises Doubt if no joint above
    the arms can be the head.
    """
    paths = [path_to_root(rig.parents, j) for j in range(len(rig.names))]
    limbs = legs.all_joints | arms.all_joints
    above = [j for j, path in enumerate(paths) if arms.hub in path and not limbs & set(path)]
    named = [j for j in above if part_of(rig.names[j]) == "head" and not is_end(rig.names[j])]
    named = [j for j in named if side_of(rig.names[j]) is None]
    if named:  # of several, the one nearest to the root counts
        head = min(named, key=lambda j: len(paths[j]))
    else:
        head = _head_by_place(rig, legs, arms, {j: paths[j] for j in above if j != arms.hub})
    spine = path_between(rig.parents, legs.hub, arms.hub)
    return head, tuple(j for j in path_between(rig.parents, arms.hub, head)[1:-1] if j not in spine)


def _head_by_place(rig: MovingRig, legs: Limbs, arms: Limbs, paths: dict[int, list[int]]) -> int:
    """The last joint of the chain that goes furthest beyond the shoulders.

    Joints that only mark the end of the head do not count. paths: joint -> its path to the root, for each
    joint above the arms that is in no limb.
    """
    trunk = unit(rig.vectors(legs.hub, arms.hub))
    shoulders = sum(rig.positions[:, chain[0]] for chain in arms.chains) / 2

    def height(j: int) -> float:
        # How far a joint lies beyond the shoulders, along the trunk.
        return float(np.mean(np.sum((rig.positions[:, j] - shoulders) * trunk, axis=-1)))

    # A head is single. Hair, ears and wings come in pairs, a left and a right one, so they are left out.
    limbs = legs.all_joints | arms.all_joints
    twins = set().union(*(pair.all_joints for pair in rig.limb_pairs if not pair.all_joints & limbs))
    single = [j for j, path in paths.items() if not twins & set(path) and not side_of(rig.names[j])]
    candidates = single or list(paths)
    if not candidates:
        raise Doubt("there is no joint for the head above the arms")
    chain = [j for j in paths[max(candidates, key=height)] if j in candidates][::-1]
    leg_length = rig.distance(legs.chains[0][0], legs.chains[0][-1])
    # Joints too far from the shoulders, or hardly away from their parents, only mark the end of the head.
    while len(chain) > 1 and (
        height(chain[-1]) > 0.42 * leg_length or rig.lengths[chain[-1]] < 0.01 * rig.size
    ):
        chain.pop()
    return chain[-1]


def _left_leg_first(rig: MovingRig, legs: Limbs, head: int) -> tuple[Limbs, bool]:
    """The legs with the left one first, and whether names say which one it is. head: the joint of the head.

    If names do not tell, left follows from the directions up (to the head) and forward (where feet and, with
    less weight, knees point).
    """
    votes = _named_sides(rig, legs)
    if votes[0] * votes[1] < 0:
        return (legs if votes[0] > 0 else _exchanged(legs)), True
    up = unit(rig.positions[:, head] - sum(rig.positions[:, joints[2]] for joints in legs.joints) / 2)
    forward = np.zeros_like(up)
    for k, joints in enumerate(legs.joints):
        forward += bend_direction(*(rig.positions[:, j] for j in joints))
        ball = _find_toe(rig, legs, k)
        forward += 0.0 if ball is None else 3 * rig.vectors(joints[2], ball)
    from_other = unit(rig.vectors(legs.joints[1][0], legs.joints[0][0]))
    # Up times forward is left. The mean cosine between left and the line from leg 1 to leg 0:
    cosine = float(np.mean(np.sum(np.cross(up, unit(forward)) * from_other, axis=-1)))
    if abs(cosine) < 0.3:
        raise Doubt("neither names nor feet and knees show which side is left")
    return (legs if cosine > 0 else _exchanged(legs)), False


def _left_arm_first(rig: MovingRig, legs: Limbs, arms: Limbs) -> Limbs:
    """The arms with the left one first: the one on the side of the left leg, the first one of `legs`.

    Raises Doubt if places and names disagree.
    """
    hips, shoulders = (unit(rig.vectors(limbs.joints[1][0], limbs.joints[0][0])) for limbs in (legs, arms))
    # Positive if arm 0 is on the side of the left leg.
    side = float(np.mean(np.sum(hips * shoulders, axis=-1)))
    votes = _named_sides(rig, arms)
    named = votes[0] * votes[1] < 0
    as_named = side * np.sign(votes[0] - votes[1]) if named else abs(side)
    if as_named < 0.2:
        turned = np.degrees(np.arccos(np.clip(as_named, -1, 1)))
        raise Doubt(f"its shoulders are turned by {turned:.0f} degrees against its hips on average")
    return arms if side > 0 else _exchanged(arms)


def _exchanged(limbs: Limbs) -> Limbs:
    """The same limbs with the first and the second chain exchanged."""
    return replace(limbs, chains=limbs.chains[::-1], joints=limbs.joints[::-1])


def _named_sides(rig: MovingRig, limbs: Limbs) -> list[int]:
    """For each of the two chains, how many more of its joints are named left than right."""
    votes = []
    for chain, opposite in (limbs.chains, limbs.chains[::-1]):
        sides = [side_of(rig.names[j]) for j in chain]
        if not any(sides):  # two names like lfemur and rfemur show their sides only together
            sides = [side_of_pair(rig.names[a], rig.names[b]) for a, b in zip(chain, opposite, strict=False)]
        votes.append(sides.count("left") - sides.count("right"))
    return votes


def on_four_legs(body: Body, positions: Array) -> bool:
    """Whether the figure stands on hands and feet, with a level trunk, in nearly all frames.

    If its arms are as long as front legs, some of the frames are enough.

    positions: (F, J, 3) of the joints in the world, in any unit and along any axes.
    """
    hips, feet = (middle(positions, body.legs, k) for k in (0, 2))
    chest, hands = (middle(positions, body.arms, k) for k in (1, 3))
    bones = [bone for leg in body.legs.values() for bone in pairwise(leg[:3])]
    leg_length = 0.5 * sum(np.linalg.norm(positions[:, b] - positions[:, a], axis=-1) for a, b in bones)
    # No axis needs to point up, because down is the direction from the hips to the feet.
    down, depth = unit(feet - hips), np.linalg.norm(feet - hips, axis=-1)
    trunk_level = np.sum(unit(chest - hips) * down, axis=-1) > LEVEL
    hands_low = np.sum((hands - hips) * down, axis=-1) > REACH * depth
    share = np.mean(trunk_level & hands_low & (depth > STRETCHED * leg_length))
    bones = [bone for arm in body.arms.values() for bone in pairwise(arm[1:])]
    arm_length = 0.5 * sum(np.linalg.norm(positions[:, b] - positions[:, a], axis=-1) for a, b in bones)
    return bool(share > (SOMETIMES if np.median(arm_length / leg_length) > LONG_ARMS else NEARLY_ALL))
