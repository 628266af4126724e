"""Finds the legs, arms, trunk and head of an unknown rig, from structure, motion and names.

Limbs come in pairs: two chains that start at the same joint, are equally long bone by bone, and bend in the
middle. The legs point away from the joint that carries the arms, and they are the longer pair. Names show
which side is left. Where they do not, the side follows from the place of the head and from where feet and
knees point, but only in right-handed coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hobble.core.quat import Array
from hobble.motion.body import SIDES, Body
from hobble.motion.doubt import Doubt, TwoFigures
from hobble.motion.find_head import find_head
from hobble.motion.find_limbs import clavicle, find_limbs, joints_of, toe
from hobble.motion.find_sides import left_arm, left_leg
from hobble.motion.moving_rig import MovingRig
from hobble.motion.names import part_of
from hobble.motion.tree import above, common, path


@dataclass(frozen=True)
class FoundBody:
    """The body of a rig. sided: whether the names of its joints distinguish left and right."""

    body: Body
    sided: bool


def find_body(names: Sequence[str], parents: Sequence[int], positions: Array) -> FoundBody:
    """Find the parts of a body.

    names, parents: of the J joints; the root's parent is -1. positions: (F, J, 3) of the joints in the world,
    in any unit and along any axes. Raises TwoFigures if there is a second body, and Doubt if the rig and the
    motion do not determine the parts.
    """
    rig = MovingRig(tuple(names), tuple(parents), positions)
    pairs = rig.pairs()
    if len(pairs) < 2:
        raise Doubt("its joints do not contain two equal legs and two equal arms")
    legs, arms = find_limbs(rig, pairs)
    leg_joints = [joints_of(rig, legs, "leg", k) for k in (0, 1)]
    arm_joints = [joints_of(rig, arms, "arm", k) for k in (0, 1)]
    head, neck = find_head(rig, legs, arms)
    left_leg_index, sided = left_leg(rig, legs, leg_joints, head)
    left_arm_index = left_arm(rig, leg_joints, left_leg_index, arm_joints, arms)
    hips = common(parents, [leg_joints[0][0], leg_joints[1][0]])
    hips = parents[hips] if hips in (leg_joints[0][0], leg_joints[1][0]) else hips
    trunk = [j for j in path(parents, hips, arms.hub) if j != hips and (j not in above(parents, hips))]
    if len(trunk) > 1 and part_of(names[trunk[-1]]) == "neck" and head != trunk[-1]:
        neck = (trunk.pop(), *neck)  # in rigs of 3ds Max the neck carries the arms
    leg_of_side = {SIDES[0]: left_leg_index, SIDES[1]: 1 - left_leg_index}
    arm_of_side = {SIDES[0]: left_arm_index, SIDES[1]: 1 - left_arm_index}
    body = Body(
        hips,
        tuple(trunk),
        neck,
        head,
        {s: (clavicle(rig, arms, k, arm_joints[k][0]), *arm_joints[k]) for s, k in arm_of_side.items()},
        {s: (*leg_joints[k], toe(rig, legs, k, leg_joints[k][2])) for s, k in leg_of_side.items()},
    )
    if other := _second(names, parents, positions, hips):
        raise TwoFigures(f"it holds two figures, {names[hips]} and {names[other]}")
    return FoundBody(body, sided)


def _second(names: Sequence[str], parents: Sequence[int], positions: Array, hips: int) -> int | None:
    """The top joint of a second figure in the file, or None. hips: those of the first figure."""
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
