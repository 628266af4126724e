"""Finds the legs, arms, trunk and head of an unknown rig, from structure, motion and names.

Limbs come in pairs: two chains of joints that start at the same joint and bend in the middle. Each bone of
one chain is as long as its counterpart in the other. The legs point away from the joint that carries the
arms, and they are the longer pair. Names show which side is left. Where they do not, the place of the head
and the direction of feet and knees show it, but this is right only in right-handed coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hobble.core.quat import Array
from hobble.motion.body import SIDES, Body
from hobble.motion.doubt import Doubt, TwoFigures
from hobble.motion.find_head import find_head
from hobble.motion.find_limbs import find_clavicle, find_limbs, find_toe, limb_joints
from hobble.motion.find_sides import find_left_arm, find_left_leg
from hobble.motion.moving_rig import MovingRig
from hobble.motion.names import part_of
from hobble.motion.tree import lowest_common_ancestor, path_between, path_to_root


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
    pairs = rig.limb_pairs()
    if len(pairs) < 2:
        raise Doubt("its joints do not contain two equal legs and two equal arms")
    legs, arms = find_limbs(rig, pairs)
    leg_joints = [limb_joints(rig, legs, "leg", k) for k in (0, 1)]
    arm_joints = [limb_joints(rig, arms, "arm", k) for k in (0, 1)]
    head, neck = find_head(rig, legs, arms)
    left_leg, sided = find_left_leg(rig, legs, leg_joints, head)
    left_arm = find_left_arm(rig, leg_joints, left_leg, arm_joints, arms)
    # The body's hips are the joint from which both hip joints (the tops of the thighs) hang.
    hips = lowest_common_ancestor(parents, [leg_joints[0][0], leg_joints[1][0]])
    hips = parents[hips] if hips in (leg_joints[0][0], leg_joints[1][0]) else hips
    trunk = [
        j
        for j in path_between(parents, hips, arms.hub)
        if j != hips and (j not in path_to_root(parents, hips))
    ]
    if len(trunk) > 1 and part_of(names[trunk[-1]]) == "neck" and head != trunk[-1]:
        neck = (trunk.pop(), *neck)  # in rigs of 3ds Max the neck carries the arms
    # Side -> index (0 or 1) of the chain in its pair.
    leg_of_side = {SIDES[0]: left_leg, SIDES[1]: 1 - left_leg}
    arm_of_side = {SIDES[0]: left_arm, SIDES[1]: 1 - left_arm}
    body = Body(
        hips,
        tuple(trunk),
        neck,
        head,
        {s: (find_clavicle(rig, arms, k, arm_joints[k][0]), *arm_joints[k]) for s, k in arm_of_side.items()},
        {s: (*leg_joints[k], find_toe(rig, legs, k, leg_joints[k][2])) for s, k in leg_of_side.items()},
    )
    if other := _find_second_figure(names, parents, positions, hips):
        raise TwoFigures(f"it has two figures, {names[hips]} and {names[other]}")
    return FoundBody(body, sided)


def _find_second_figure(
    names: Sequence[str], parents: Sequence[int], positions: Array, hips: int
) -> int | None:
    """The top joint of a second figure in the file, or None.

    hips: index of the first figure's hips. A second figure hangs from a joint above them, on another branch.
    """
    above_hips = path_to_root(parents, hips)  # the first of them is the hips
    for top in range(len(parents)):
        if parents[top] not in above_hips[1:] or top in above_hips:
            continue
        branch = [j for j in range(len(parents)) if top in path_to_root(parents, j)]
        new = {old: i for i, old in enumerate(branch)}  # joint -> its index in the branch
        branch_parents = [new.get(parents[j], -1) for j in branch]
        try:
            find_body([names[j] for j in branch], branch_parents, positions[:, branch])
        except Doubt:
            continue
        return top
    return None
