"""Finds the head of a rig, and its neck."""

from __future__ import annotations

import numpy as np

from hobble.motion.doubt import Doubt
from hobble.motion.moving_rig import LimbPair, MovingRig
from hobble.motion.names import is_end, part_of, side_of
from hobble.motion.orient import unit_vectors
from hobble.motion.tree import path_between, path_to_root


def find_head(rig: MovingRig, legs: LimbPair, arms: LimbPair) -> tuple[int, tuple[int, ...]]:
    """The index of the head, and those of the neck's joints.

    The neck's joints lie between the joint that carries the arms and the head. Raises Doubt if no joint above
    the arms can be the head.
    """
    limbs = set(sum(legs.chains, ())) | set(sum(arms.chains, ()))
    named = [
        j for j, n in enumerate(rig.names) if part_of(n) == "head" and not is_end(n) and side_of(n) is None
    ]
    named = [
        j
        for j in named
        if arms.hub in path_to_root(rig.parents, j) and not limbs & set(path_to_root(rig.parents, j))
    ]
    spine = path_between(
        rig.parents, legs.hub, arms.hub
    )  # the hub of a pair is the joint from which its limbs hang
    # If several joints are named as head, the one nearest to the root counts.
    named_head = min(named, key=lambda j: len(path_to_root(rig.parents, j)), default=None)
    head = _head_by_place(rig, legs, arms, limbs) if named_head is None else named_head
    between = path_between(rig.parents, arms.hub, head)[1:-1]
    return head, tuple(j for j in between if j not in spine)


def _head_by_place(rig: MovingRig, legs: LimbPair, arms: LimbPair, limbs: set[int]) -> int:
    """The last joint of the chain that goes furthest beyond the shoulders.

    Joints that only mark the end of the head do not count. limbs: all joints of arms and legs.
    """
    trunk = unit_vectors(rig.sampled_positions[:, arms.hub] - rig.sampled_positions[:, legs.hub])
    shoulders = sum(rig.sampled_positions[:, chain[0]] for chain in arms.chains) / 2

    def height(j: int) -> float:
        # How far a joint lies beyond the shoulders, along the trunk.
        return float(np.mean(np.sum((rig.sampled_positions[:, j] - shoulders) * trunk, axis=-1)))

    candidates = [j for j in range(len(rig.names)) if arms.hub in path_to_root(rig.parents, j)[1:]]
    candidates = [j for j in candidates if not limbs & set(path_to_root(rig.parents, j))]
    # A head is single. Hair, ears and wings come in pairs, a left and a right one, so they are left out.
    pairs = [set(sum(pair.chains, ())) for pair in rig.limb_pairs()]
    twins = set().union(*(pair for pair in pairs if not pair & limbs))
    single = [
        j for j in candidates if not twins & set(path_to_root(rig.parents, j)) and not side_of(rig.names[j])
    ]
    candidates = single or candidates
    if not candidates:
        raise Doubt("there is no joint for the head above the arms")
    top = max(candidates, key=height)
    chain = [j for j in path_to_root(rig.parents, top) if j in candidates][::-1]
    leg_length = rig.distance_and_variation(legs.chains[0][0], legs.chains[0][-1])[0]
    # Joints too far from the shoulders, or hardly away from their parents, only mark the end of the head.
    while len(chain) > 1 and (
        height(chain[-1]) > 0.42 * leg_length or rig.lengths[chain[-1]] < 0.01 * rig.size
    ):
        chain.pop()
    return chain[-1]
