"""Finds which pairs of chains are the legs and the arms of a rig, and the joints of these limbs.

A chain is a row of joints from the trunk outward. A `LimbPair` is two equally long chains below one joint,
its hub. `places` are the indices of three joints in both chains: hip, knee and ankle, or shoulder, elbow and
wrist.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hobble.motion.doubt import Doubt
from hobble.motion.moving_rig import LimbPair, MovingRig
from hobble.motion.names import is_control, limb_parts, part_of
from hobble.motion.orient import unit_vectors

RIGID = 0.03  # two joints can be the ends of one bone if their distance varies by at most this share
RATIOS = {"leg": (0.6, 1.6), "arm": (0.48, 1.6)}  # range of shank / thigh, and of forearm / upper arm
# Least distance of the two hips as a share of the distance of the knees, and of the two shoulders as a share
# of the distance of the elbows. The shares are small, because knees and elbows may be spread for balance.
APART = {"leg": 0.2, "arm": 0.4}
SWING = 10.0  # degrees: chains whose bend varies by this much or more get the full score in `_swing_score`
# Largest mean cosine of the angle between legs and trunk, both seen from the hips. It is -1 if they point in
# opposite directions, as in a standing body.
AWAY = -0.2
WORDS = {  # words in the names of joints (`names.part_of`) that suggest a kind of limb
    "leg": {"thigh", "shank", "foot", "ankle", "toe", "leg", "hip"},
    "arm": {"clavicle", "upperarm", "forearm", "hand", "wrist", "finger", "arm", "shoulder"},
}
# Parts of a limb, from the trunk outward. Each is the name of the joint where the part begins.
LIMBS = {"leg": ("thigh", "shank", "foot"), "arm": ("upperarm", "forearm", "hand")}


def find_limbs(rig: MovingRig, pairs: list[LimbPair]) -> tuple[LimbPair, LimbPair]:
    """The pair of legs and the pair of arms of the likeliest body. pairs: all pairs of chains in the rig.

    Raises Doubt if no two pairs can be legs and arms.
    """
    places_of = {}
    for i, pair in enumerate(pairs):
        for kind in ("leg", "arm"):
            if (places := find_places(rig, pair, kind)) is not None:
                places_of[i, kind] = places
    bodies = []
    for i, legs in enumerate(pairs):
        for k, arms in enumerate(pairs):
            if legs.hub == arms.hub or (i, "leg") not in places_of or (k, "arm") not in places_of:
                continue
            if set(sum(legs.chains, ())) & set(sum(arms.chains, ())):
                continue
            away = _legs_along_trunk(rig, legs, places_of[i, "leg"], arms)
            if away > AWAY:
                continue
            leg_length = _limb_length(rig, legs, places_of[i, "leg"])
            arm_length = _limb_length(rig, arms, places_of[k, "arm"])
            # Legs are longer than arms, and point away from the trunk.
            score = np.log(leg_length / arm_length) - away
            for pair, places, kind in (
                (legs, places_of[i, "leg"], "leg"),
                (arms, places_of[k, "arm"], "arm"),
            ):
                score += _name_score(rig, pair, kind) + _swing_score(rig, pair, places)
            bodies.append((score, i, k))
    if not bodies:
        raise Doubt("the motion does not show which chains are legs and which are arms")
    _, i, k = max(bodies)
    return pairs[i], pairs[k]


def _legs_along_trunk(rig: MovingRig, legs: LimbPair, places: tuple[int, int, int], arms: LimbPair) -> float:
    """Mean cosine of the angle between legs and trunk, both seen from the hips: -1 for a standing body.

    places: of the legs.
    """
    trunk = rig.sampled_positions[:, arms.hub] - rig.sampled_positions[:, legs.hub]
    feet = (
        sum(rig.sampled_positions[:, chain[places[2]]] for chain in legs.chains) / 2
        - rig.sampled_positions[:, legs.hub]
    )
    return float(np.mean(np.sum(unit_vectors(trunk) * unit_vectors(feet), axis=-1)))


def _limb_length(rig: MovingRig, pair: LimbPair, places: tuple[int, int, int]) -> float:
    """Length of the two bones between the places, in the first chain of a pair."""
    a, b, c = (pair.chains[0][place] for place in places)
    return rig.distance_and_variation(a, b)[0] + rig.distance_and_variation(b, c)[0]


def _swing_score(rig: MovingRig, pair: LimbPair, places: tuple[int, int, int]) -> float:
    """Score from 0 to 1 for how much the limbs bend and stretch.

    Hair, skirts and wings often keep one angle.
    """
    ranges = [np.ptp(np.percentile(rig.bend_degrees(chain, *places), [3, 97])) for chain in pair.chains]
    return float(np.minimum(np.mean(ranges) / SWING, 1.0))


def _name_score(rig: MovingRig, pair: LimbPair, kind: str) -> float:
    """Score from -1 to 1 for how strongly the names of a pair's joints suggest a kind of limb.

    Names of the other kind of limb lower the score. So do names of joints that are not part of the body but
    control other joints. kind: "leg" or "arm".
    """
    names = [rig.names[j] for chain in pair.chains for j in chain]
    parts = [part_of(name) for name in names]
    other = "arm" if kind == "leg" else "leg"
    against = sum(p in WORDS[other] or is_control(n) for p, n in zip(parts, names, strict=True))
    return (sum(p in WORDS[kind] for p in parts) - against) / len(parts)


def find_places(rig: MovingRig, pair: LimbPair, kind: str) -> tuple[int, int, int] | None:
    """Indices of hip, knee and ankle, or of shoulder, elbow and wrist, in both chains.

    kind: "leg" or "arm". Returns None if the pair cannot be of this kind. Names decide if they tell all three
    joints and the two bones between these have the proportions of a body. Otherwise the two bones are the
    longest consecutive ones that keep their lengths and have a bend between them. A bone may consist of
    several joints in line (twist joints): its length is the distance of the first and the last.
    """
    chain = pair.chains[0]
    named = [limb_parts([rig.names[j] for j in c]) for c in pair.chains]
    if all(set(LIMBS[kind]) <= set(found) for found in named):
        places, across = (tuple(found[part] for part in LIMBS[kind]) for found in named)
        if places == across and places[0] < places[1] < places[2] and _fits(rig, chain, places, kind):
            return places[0], places[1], places[2]
    best, where = 0.0, None
    for j in range(1, len(chain) - 1):
        for i in range(j):
            if _changes_length(rig, pair, i, j) or not _begin_apart(rig, pair, i, j, kind):
                continue
            for k in range(j + 1, len(chain)):
                if not _fits(rig, chain, (i, j, k), kind):
                    continue
                if _changes_length(rig, pair, j, k) or not _bends(rig, pair, i, j, k):
                    continue
                total = (
                    rig.distance_and_variation(chain[i], chain[j])[0]
                    + rig.distance_and_variation(chain[j], chain[k])[0]
                )
                if total > best * 1.0001:  # of equal lengths the first counts, whatever their rounding errors
                    best, where = total, (i, j, k)
                break  # the lower bone ends at the first joint that fits
    return where


def _fits(rig: MovingRig, chain: Sequence[int], places: Sequence[int], kind: str) -> bool:
    """Whether the two bones between the places have the proportions of a leg or an arm, and are not tiny."""
    i, j, k = (chain[p] for p in places)
    upper, lower = rig.distance_and_variation(i, j)[0], rig.distance_and_variation(j, k)[0]
    low, high = RATIOS[kind]
    return min(upper, lower) > 0.03 * rig.size and low <= lower / max(upper, 1e-9) <= high


def _changes_length(rig: MovingRig, pair: LimbPair, i: int, j: int) -> bool:
    """Whether the distance between two joints of a chain changes, so that no single bone connects them.

    i, j: indices of the two joints in both chains.
    """
    return any(rig.distance_and_variation(chain[i], chain[j])[1] > RIGID for chain in pair.chains)


def _begin_apart(rig: MovingRig, pair: LimbPair, i: int, j: int, kind: str) -> bool:
    """Whether the two limbs begin apart from each other, as at the shoulders or hips, not at the collarbones.

    i, j: indices in both chains of the joints that may be shoulder and elbow, or hip and knee.
    """
    at_beginning, at_middle = (
        np.median(np.linalg.norm(rig.sampled_positions[:, a] - rig.sampled_positions[:, b], axis=-1))
        for a, b in ((pair.chains[0][i], pair.chains[1][i]), (pair.chains[0][j], pair.chains[1][j]))
    )
    return bool(at_beginning >= APART[kind] * at_middle)


def _bends(rig: MovingRig, pair: LimbPair, i: int, j: int, k: int) -> bool:
    """Whether at least one limb of the pair bends at `j`, between `i` and `k`, by more than six degrees.

    i, j, k: indices in both chains.
    """
    for chain in pair.chains:
        angle = rig.bend_degrees(chain, i, j, k)
        if np.percentile(angle, 97) > 6:
            return True
    return False


def limb_joints(rig: MovingRig, pair: LimbPair, kind: str, k: int) -> tuple[int, int, int]:
    """Hip, knee and ankle, or shoulder, elbow and wrist, of chain `k` (0 or 1) of a pair that has them.

    kind: "leg" or "arm".
    """
    places = find_places(rig, pair, kind)
    assert places is not None
    a, b, c = places
    return pair.chains[k][a], pair.chains[k][b], pair.chains[k][c]


def find_toe(rig: MovingRig, pair: LimbPair, k: int, heel: int) -> int | None:
    """The joint at the ball of a foot, or None if the rig has none.

    It is the joint that is named as toe, else the first joint that is clearly away from the ankle. k: which
    chain of the pair, 0 or 1. heel: the joint of the ankle.
    """
    chain = pair.chains[k]
    leg_length = pair.length
    after_heel = chain[chain.index(heel) + 1 :]
    place = limb_parts([rig.names[j] for j in chain]).get("toe")
    named = None if place is None else chain[place]
    if (
        named is not None
        and named in after_heel
        and rig.distance_and_variation(heel, named)[0] > 0.03 * leg_length
    ):
        return named
    found = next((j for j in after_heel if rig.distance_and_variation(heel, j)[0] > 0.06 * leg_length), None)
    if found is None or part_of(rig.names[found]) != "ankle":
        return found
    # A second joint is named as ankle: this chain goes to the back of the heel, and another one to the toe.
    toes = (j for j in rig.children[heel] if part_of(rig.names[j]) == "toe")
    return next((j for j in toes if rig.distance_and_variation(heel, j)[0] > 0.03 * leg_length), None)


def find_clavicle(rig: MovingRig, pair: LimbPair, k: int, shoulder: int) -> int | None:
    """The joint between chest and shoulder that moves the shoulder, or None if there is none.

    A joint at the same place as the shoulder does not count. k: which chain of the pair, 0 or 1.
    """
    chain = pair.chains[k]
    before_shoulder = chain[: chain.index(shoulder)]
    away = [j for j in before_shoulder if rig.distance_and_variation(j, shoulder)[0] > 0.01 * rig.size]
    return away[-1] if away else None
