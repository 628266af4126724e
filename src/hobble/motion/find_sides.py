"""Finds which leg and which arm of a rig are the left ones."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.motion.doubt import Doubt
from hobble.motion.find_limbs import toe
from hobble.motion.moving_rig import LimbPair, MovingRig
from hobble.motion.names import side_of, side_of_pair
from hobble.motion.orient import unit


def left_leg(rig: MovingRig, pair: LimbPair, leg: list[tuple[int, int, int]], head: int) -> tuple[int, bool]:
    """Which of the two legs (0 or 1) is the left one, and whether names say so.

    leg: hip, knee and ankle of both chains of `pair`. head: the joint of the head. If names do not tell, left
    follows from the directions up (to the head) and forward (where feet and knees point).
    """
    named = _named_sides(rig, pair)
    if named[0] * named[1] < 0:
        return (0 if named[0] > 0 else 1), True
    up = unit(rig.at[:, head] - sum(rig.at[:, j[2]] for j in leg) / 2)
    ahead = _ahead(rig, pair, leg)
    across = rig.at[:, leg[0][0]] - rig.at[:, leg[1][0]]
    turn = float(np.mean(np.sum(np.cross(up, ahead) * unit(across), axis=-1)))
    if abs(turn) < 0.3:
        raise Doubt("neither names nor feet and knees show which side is left")
    return (0 if turn > 0 else 1), False


def _named_sides(rig: MovingRig, pair: LimbPair) -> tuple[int, int]:
    """For each of the two chains, how many more of its joints are named left than right."""
    votes = []
    for chain, opposite in (pair.chains, pair.chains[::-1]):
        sides = [side_of(rig.names[j]) for j in chain]
        if not any(sides):
            sides = [side_of_pair(rig.names[a], rig.names[b]) for a, b in zip(chain, opposite, strict=False)]
        votes.append(sides.count("left") - sides.count("right"))
    return votes[0], votes[1]


def _ahead(rig: MovingRig, pair: LimbPair, leg: list[tuple[int, int, int]]) -> Array:
    """(S, 3) unit vectors forward in S sampled frames: where feet and, with less weight, knees point."""
    out = np.zeros((len(rig.at), 3))
    for k, (hip, knee, heel) in enumerate(leg):
        ball = toe(rig, pair, k, heel)
        line = rig.at[:, heel] - rig.at[:, hip]
        share = np.sum((rig.at[:, knee] - rig.at[:, hip]) * line, axis=-1, keepdims=True)
        bend = rig.at[:, knee] - rig.at[:, hip] - line * share / np.sum(line**2, axis=-1, keepdims=True)
        out += bend
        if ball is not None:
            out += 3 * (rig.at[:, ball] - rig.at[:, heel])
    return unit(out)


def left_arm(
    rig: MovingRig,
    leg: list[tuple[int, int, int]],
    left: int,
    arm: list[tuple[int, int, int]],
    pair: LimbPair,
) -> int:
    """Which of the two arms (0 or 1) is the left one: the one on the side of the left leg.

    leg: hip, knee and ankle of both legs. left: which leg (0 or 1) is the left one. arm: shoulder, elbow and
    wrist of both arms. pair: the chains of the arms.
    """
    across = rig.at[:, leg[left][0]] - rig.at[:, leg[1 - left][0]]
    arms = rig.at[:, arm[0][0]] - rig.at[:, arm[1][0]]
    side = float(np.mean(np.sum(unit(across) * unit(arms), axis=-1)))
    named = _named_sides(rig, pair)
    index = 0 if side > 0 else 1
    if abs(side) < 0.2 or (named[0] * named[1] < 0 and (named[0] > 0) != (index == 0)):
        raise Doubt("its left arm and its left leg are not on the same side")
    return index
