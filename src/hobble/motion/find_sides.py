"""Finds which leg and which arm of a rig are the left ones."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.motion.doubt import Doubt
from hobble.motion.find_limbs import find_toe
from hobble.motion.moving_rig import LimbPair, MovingRig
from hobble.motion.names import side_of, side_of_pair
from hobble.motion.orient import unit_vectors


def find_left_leg(
    rig: MovingRig, pair: LimbPair, leg_joints: list[tuple[int, int, int]], head: int
) -> tuple[int, bool]:
    """Which of the two legs (0 or 1) is the left one, and whether names say so.

    leg_joints: hip, knee and ankle of both chains of `pair`. head: the joint of the head. If names do not
    tell, left follows from the directions up (to the head) and forward (where feet and knees point).
    """
    named = _named_sides(rig, pair)
    if named[0] * named[1] < 0:
        return (0 if named[0] > 0 else 1), True
    up = unit_vectors(
        rig.sampled_positions[:, head] - sum(rig.sampled_positions[:, j[2]] for j in leg_joints) / 2
    )
    forward = _forward(rig, pair, leg_joints)
    across = rig.sampled_positions[:, leg_joints[0][0]] - rig.sampled_positions[:, leg_joints[1][0]]
    # Up times forward is left. The mean cosine between left and the line from leg 1 to leg 0:
    cosine = float(np.mean(np.sum(np.cross(up, forward) * unit_vectors(across), axis=-1)))
    if abs(cosine) < 0.3:
        raise Doubt("neither names nor feet and knees show which side is left")
    return (0 if cosine > 0 else 1), False


def _named_sides(rig: MovingRig, pair: LimbPair) -> tuple[int, int]:
    """For each of the two chains, how many more of its joints are named left than right."""
    votes = []
    for chain, opposite in (pair.chains, pair.chains[::-1]):
        sides = [side_of(rig.names[j]) for j in chain]
        if not any(sides):  # two names like lfemur and rfemur show their sides only together
            sides = [side_of_pair(rig.names[a], rig.names[b]) for a, b in zip(chain, opposite, strict=False)]
        votes.append(sides.count("left") - sides.count("right"))
    return votes[0], votes[1]


def _forward(rig: MovingRig, pair: LimbPair, leg_joints: list[tuple[int, int, int]]) -> Array:
    """(S, 3) unit vectors forward in S sampled frames: where feet and, with less weight, knees point.

    leg_joints: hip, knee and ankle of both chains of `pair`.
    """
    forward = np.zeros((len(rig.sampled_positions), 3))
    for k, (hip, knee, heel) in enumerate(leg_joints):
        ball = find_toe(rig, pair, k, heel)
        # How far the knee lies out from the straight line between hip and ankle.
        line = rig.sampled_positions[:, heel] - rig.sampled_positions[:, hip]
        along = np.sum(
            (rig.sampled_positions[:, knee] - rig.sampled_positions[:, hip]) * line, axis=-1, keepdims=True
        )
        outward = (
            rig.sampled_positions[:, knee]
            - rig.sampled_positions[:, hip]
            - line * along / np.sum(line**2, axis=-1, keepdims=True)
        )
        forward += outward
        if ball is not None:
            forward += 3 * (rig.sampled_positions[:, ball] - rig.sampled_positions[:, heel])
    return unit_vectors(forward)


def find_left_arm(
    rig: MovingRig,
    leg_joints: list[tuple[int, int, int]],
    left_leg: int,
    arm_joints: list[tuple[int, int, int]],
    arms: LimbPair,
) -> int:
    """Which of the two arms (0 or 1) is the left one: the one on the side of the left leg.

    leg_joints: hip, knee and ankle of both legs. left_leg: which leg (0 or 1) is the left one. arm_joints:
    shoulder, elbow and wrist of both arms. arms: their chains. Raises Doubt if places and names disagree.
    """
    across_hips = (
        rig.sampled_positions[:, leg_joints[left_leg][0]]
        - rig.sampled_positions[:, leg_joints[1 - left_leg][0]]
    )
    across_shoulders = rig.sampled_positions[:, arm_joints[0][0]] - rig.sampled_positions[:, arm_joints[1][0]]
    # Positive if arm 0 is on the side of the left leg.
    side = float(np.mean(np.sum(unit_vectors(across_hips) * unit_vectors(across_shoulders), axis=-1)))
    named = _named_sides(rig, arms)
    index = 0 if side > 0 else 1
    if abs(side) < 0.2 or (named[0] * named[1] < 0 and (named[0] > 0) != (index == 0)):
        raise Doubt("its left arm and its left leg are not on the same side")
    return index
