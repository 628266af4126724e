"""Finds which pairs of chains are the legs and the arms of a rig, and their joints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hobble.motion.doubt import Doubt
from hobble.motion.moving_rig import LimbPair, MovingRig
from hobble.motion.names import is_control, limb_parts, part_of
from hobble.motion.orient import unit

RIGID = 0.03  # relative change of the length between two joints that count as one bone
RATIOS = {"leg": (0.6, 1.6), "arm": (0.48, 1.6)}  # shank to thigh, forearm to upper arm
APART = {"leg": 0.2, "arm": 0.4}  # of hips to knees, of shoulders to elbows, which may be spread for balance
SWING = 10.0  # degrees: limbs that bend and stretch by more are surely limbs
AWAY = -0.2  # legs and trunk point apart if the cosine between them is below this
WORDS = {
    "leg": {"thigh", "shank", "foot", "ankle", "toe", "leg", "hip"},
    "arm": {"clavicle", "upperarm", "forearm", "hand", "wrist", "finger", "arm", "shoulder"},
}
LIMBS = {"leg": ("thigh", "shank", "foot"), "arm": ("upperarm", "forearm", "hand")}


def find_limbs(rig: MovingRig, pairs: list[LimbPair]) -> tuple[LimbPair, LimbPair]:
    """The pair of legs and the pair of arms of the likeliest body."""
    known = {}
    for i, pair in enumerate(pairs):
        for kind in ("leg", "arm"):
            if (middle := segments(rig, pair, kind)) is not None:
                known[i, kind] = middle
    found = []
    for i, legs in enumerate(pairs):
        for k, arms in enumerate(pairs):
            if legs.hub == arms.hub or (i, "leg") not in known or (k, "arm") not in known:
                continue
            if set(sum(legs.chains, ())) & set(sum(arms.chains, ())):
                continue
            away = _away(rig, legs, known[i, "leg"], arms)
            if away > AWAY:
                continue
            ratio = _length_between(rig, legs, known[i, "leg"]) / _length_between(rig, arms, known[k, "arm"])
            score = np.log(ratio) - away
            for pair, place, kind in ((legs, known[i, "leg"], "leg"), (arms, known[k, "arm"], "arm")):
                score += _named(rig, pair, kind) + _swing(rig, pair, place)
            found.append((score, i, k))
    if not found:
        raise Doubt("the motion does not show which chains are legs and which are arms")
    _, i, k = max(found)
    return pairs[i], pairs[k]


def _away(rig: MovingRig, legs: LimbPair, middle: tuple[int, int, int], arms: LimbPair) -> float:
    """Mean cosine between the directions to the feet and to the arms' root; -1 for a standing body."""
    trunk = rig.at[:, arms.hub] - rig.at[:, legs.hub]
    feet = sum(rig.at[:, chain[middle[2]]] for chain in legs.chains) / 2 - rig.at[:, legs.hub]
    return float(np.mean(np.sum(unit(trunk) * unit(feet), axis=-1)))


def _length_between(rig: MovingRig, pair: LimbPair, middle: tuple[int, int, int]) -> float:
    a, b, c = middle
    return (
        rig.chord(pair.chains[0][a], pair.chains[0][b])[0]
        + rig.chord(pair.chains[0][b], pair.chains[0][c])[0]
    )


def _swing(rig: MovingRig, pair: LimbPair, middle: tuple[int, int, int]) -> float:
    """How much the limbs bend and stretch, 0 to 1. Hair, skirts and wings often keep one angle."""
    turns = [np.ptp(np.percentile(rig.bend(chain, *middle), [3, 97])) for chain in pair.chains]
    return float(np.minimum(np.mean(turns) / SWING, 1.0))


def _named(rig: MovingRig, pair: LimbPair, kind: str) -> float:
    """How strongly names suggest a kind of limb, -1 to 1. Joints that control others count against it."""
    names = [rig.names[j] for chain in pair.chains for j in chain]
    parts = [part_of(name) for name in names]
    other = "arm" if kind == "leg" else "leg"
    against = sum(p in WORDS[other] or is_control(n) for p, n in zip(parts, names, strict=True))
    return (sum(p in WORDS[kind] for p in parts) - against) / len(parts)


def segments(rig: MovingRig, pair: LimbPair, kind: str) -> tuple[int, int, int] | None:
    """Indices in the chains of hip, knee and ankle, or of shoulder, elbow and wrist.

    Names count if they give all three and the bones have the proportions of a body. Otherwise the two
    bones are the longest consecutive ones that keep their length and bend between. A chain of twist
    joints along a bone keeps its length from end to end.
    """
    chain = pair.chains[0]
    named = [limb_parts([rig.names[j] for j in c]) for c in pair.chains]
    if all(set(LIMBS[kind]) <= set(found) for found in named):
        one, other = (tuple(found[part] for part in LIMBS[kind]) for found in named)
        if one == other and one[0] < one[1] < one[2] and _fits(rig, chain, one, kind):
            return one[0], one[1], one[2]
    best, where = 0.0, None
    for j in range(1, len(chain) - 1):
        for i in range(j):
            if _moves(rig, pair, i, j) or not _apart(rig, pair, i, j, kind):
                continue
            for k in range(j + 1, len(chain)):
                if not _fits(rig, chain, (i, j, k), kind):
                    continue
                if _moves(rig, pair, j, k) or not _bends(rig, pair, i, j, k):
                    continue
                total = rig.chord(chain[i], chain[j])[0] + rig.chord(chain[j], chain[k])[0]
                if total > best * 1.0001:
                    best, where = total, (i, j, k)
                break
    return where


def _fits(rig: MovingRig, chain: Sequence[int], places: Sequence[int], kind: str) -> bool:
    i, j, k = (chain[p] for p in places)
    upper, lower = rig.chord(i, j)[0], rig.chord(j, k)[0]
    low, high = RATIOS[kind]
    return min(upper, lower) > 0.03 * rig.size and low <= lower / max(upper, 1e-9) <= high


def _moves(rig: MovingRig, pair: LimbPair, i: int, j: int) -> bool:
    """Whether the distance between two joints of a chain changes, so that they are not one bone."""
    return any(rig.chord(chain[i], chain[j])[1] > RIGID for chain in pair.chains)


def _apart(rig: MovingRig, pair: LimbPair, i: int, j: int, kind: str) -> bool:
    """Whether the limbs begin apart, like shoulders and hips and unlike collarbones."""
    at = [
        np.median(np.linalg.norm(rig.at[:, a] - rig.at[:, b], axis=-1))
        for a, b in ((pair.chains[0][i], pair.chains[1][i]), (pair.chains[0][j], pair.chains[1][j]))
    ]
    return bool(at[0] >= APART[kind] * at[1])


def _bends(rig: MovingRig, pair: LimbPair, i: int, j: int, k: int) -> bool:
    """Whether the limb bends there, by at least six degrees on either side."""
    for chain in pair.chains:
        angle = rig.bend(chain, i, j, k)
        if np.percentile(angle, 97) > 6:
            return True
    return False


def joints_of(rig: MovingRig, pair: LimbPair, kind: str, k: int) -> tuple[int, int, int]:
    """Hip, knee and ankle, or shoulder, elbow and wrist, of the chain k of a pair. It must have them."""
    places = segments(rig, pair, kind)
    assert places is not None
    a, b, c = places
    return pair.chains[k][a], pair.chains[k][b], pair.chains[k][c]


def toe(rig: MovingRig, pair: LimbPair, k: int, heel: int) -> int | None:
    """The ball of the foot: the first joint a foot's length away from the ankle, or None."""
    chain = pair.chains[k]
    leg = pair.length
    after = chain[chain.index(heel) + 1 :]
    named = limb_parts([rig.names[j] for j in chain]).get("toe")
    if named is not None and chain[named] in after and rig.chord(heel, chain[named])[0] > 0.03 * leg:
        return chain[named]
    found = next((j for j in after if rig.chord(heel, j)[0] > 0.06 * leg), None)
    if found is None or part_of(rig.names[found]) != "ankle":
        return found
    # The chain goes to the back of the heel.
    toes = (j for j in rig.children[heel] if part_of(rig.names[j]) == "toe")
    return next((j for j in toes if rig.chord(heel, j)[0] > 0.03 * leg), None)


def clavicle(rig: MovingRig, pair: LimbPair, k: int, shoulder: int) -> int | None:
    """The joint between chest and shoulder that moves the shoulder, or None."""
    chain = pair.chains[k]
    before = chain[: chain.index(shoulder)]
    moving = [j for j in before if rig.chord(j, shoulder)[0] > 0.01 * rig.size]
    return moving[-1] if moving else None
