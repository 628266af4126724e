"""The parts of a body on a rig: the joints of its trunk, limbs and head."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.fingers import pointing_fingers
from hobble.motion.tree import lowest_common_ancestor, path_between

SIDES = ("left", "right")
TRUNK = ("hips", "spine", "chest", "neck", "head")  # roles of the joints from the hips to the head
# In retargeting, each joint of the target's trunk follows a joint of the source's trunk. This joint may be
# higher, by up to this share of the trunk's length. The same holds for the neck.
REACH = 0.2


@dataclass(frozen=True)
class Body:
    """The joints of a rig that are parts of a body. All joints are given by index; tuples list parents first.

    hips: the joint that carries both thighs. trunk: from the first joint above the hips to the chest, which
    carries both arms; empty if the hips carry the arms. neck: the joints between chest and head. arms: side
    -> clavicle (or None), shoulder, elbow and wrist. legs: side -> hip, knee, heel (the ankle) and toe (the
    ball of the foot, or None). fingers: side -> the joint at the base of the finger that shows where the hand
    points; hands without one are left out. arms_on_neck: whether the arms hang from the first joint of the
    neck, as in rigs of 3ds Max, and this joint lies below the shoulders. Then the bone from the chest to the
    first joint of the neck belongs to the trunk.
    """

    hips: int
    trunk: tuple[int, ...]
    neck: tuple[int, ...]
    head: int
    arms: Mapping[str, tuple[int | None, int, int, int]]
    legs: Mapping[str, tuple[int, int, int, int | None]]
    fingers: Mapping[str, int] = field(default_factory=dict)
    arms_on_neck: bool = False

    @property
    def chest(self) -> int:
        """The last joint of the trunk, which carries the arms; the hips if the trunk is empty."""
        return self.trunk[-1] if self.trunk else self.hips

    @property
    def trunk_bones(self) -> int:
        """Number of bones from the hips to the joint where the neck begins."""
        return len(self.trunk) + int(self.arms_on_neck)

    @property
    def joints(self) -> list[int]:
        """All joints of the body except the fingers."""
        out = [self.hips, *self.trunk, *self.neck, self.head]
        for side in SIDES:
            out += [j for j in (*self.arms[side], *self.legs[side]) if j is not None]
        return out

    def renumbered(self, new: Mapping[int, int]) -> Body:
        """The same body with other joint indices.

        new: index -> new index. It must contain all `joints`. Fingers that it does not contain are left out.
        """

        def new_or_none(joint: int | None) -> int | None:
            return None if joint is None else new[joint]

        arms = {s: (new_or_none(a), new[b], new[c], new[d]) for s, (a, b, c, d) in self.arms.items()}
        legs = {s: (new[a], new[b], new[c], new_or_none(d)) for s, (a, b, c, d) in self.legs.items()}
        fingers = {s: new[j] for s, j in self.fingers.items() if j in new}
        trunk, neck = (tuple(new[j] for j in chain) for chain in (self.trunk, self.neck))
        hips, head = new[self.hips], new[self.head]
        return Body(hips, trunk, neck, head, arms, legs, fingers, self.arms_on_neck)

    def roles(self, names: Sequence[str]) -> dict[str, str]:
        """Role -> name of its joint, as in a skeleton file.

        names: the names of all joints of the rig, by index. The spine is the joint below the chest, or the
        chest if the trunk has only one joint.
        """
        out = {"hips": names[self.hips]}
        if self.trunk:
            out |= {"spine": names[self.trunk[max(0, len(self.trunk) - 2)]], "chest": names[self.chest]}
        if self.neck:
            out["neck"] = names[self.neck[-1]]
        out["head"] = names[self.head]
        for side in SIDES:
            parts = zip(("shoulder", "elbow", "wrist"), self.arms[side][1:], strict=True)
            legs = zip(("hip", "knee", "heel", "toe"), self.legs[side], strict=True)
            out |= {f"{side}_{part}": names[j] for part, j in (*parts, *legs) if j is not None}
        return out


def body_of(parents: Sequence[int], roles: Mapping[str, int]) -> Body:
    """The body whose joints have the given roles.

    The other joints of trunk, neck and clavicles are those that lie between joints with roles in the
    hierarchy.

    parents: the parent of each joint, -1 for the root. roles: role -> joint. They must include hips and head,
    and on both sides shoulder, elbow, wrist, hip, knee and heel.
    """
    hips = roles["hips"]
    shoulders = [roles[f"{side}_shoulder"] for side in SIDES]
    chest = roles.get("chest", lowest_common_ancestor(parents, shoulders))
    trunk = [j for j in path_between(parents, hips, chest) if j != hips]
    neck = [
        j
        for j in path_between(parents, chest, roles["head"])
        if j not in (chest, roles["head"], hips, *trunk)
    ]
    arms: dict[str, tuple[int | None, int, int, int]] = {}
    legs: dict[str, tuple[int, int, int, int | None]] = {}
    for side, shoulder in zip(SIDES, shoulders, strict=True):
        between = [
            j for j in path_between(parents, chest, shoulder) if j not in (chest, shoulder, *trunk, *neck)
        ]
        clavicle = between[-1] if between else None
        arms[side] = (clavicle, shoulder, roles[f"{side}_elbow"], roles[f"{side}_wrist"])
        hip, knee, heel = (roles[f"{side}_{part}"] for part in ("hip", "knee", "heel"))
        legs[side] = (hip, knee, heel, roles.get(f"{side}_toe"))
    return Body(hips, tuple(trunk), tuple(neck), roles["head"], arms, legs)


def with_fingers(body: Body, skeleton: Skeleton) -> Body:
    """The body with `fingers` filled in, by the joints' offsets and names (`hobble.motion.fingers`)."""
    return replace(body, fingers=pointing_fingers(skeleton, {s: arm[3] for s, arm in body.arms.items()}))


def body_by_roles(skeleton: Skeleton) -> Body:
    """The body of a skeleton whose roles are known."""
    body = body_of(skeleton.parents, {role: skeleton.role(role) for role in skeleton.roles})
    return with_fingers(body, skeleton)


def match_joints(source: Skeleton, source_body: Body, target: Skeleton, target_body: Body) -> dict[str, str]:
    """Name of a target joint -> name of the source joint that it follows in retargeting.

    source_body, target_body: the bodies on the skeletons `source` and `target`. The hips, the chest, the head
    and each joint of a limb follow the same part of the source's body. Each other joint of
    the trunk follows the highest source joint below a limit, which is a fifth of the trunk (REACH) above the
    joint itself. Joints of the neck are matched in the same way. Target joints without a counterpart are left
    out.
    """
    out: dict[int, int] = {target_body.hips: source_body.hips, target_body.head: source_body.head}
    target_trunk = (target_body.hips, *target_body.trunk)
    out |= _joints_along(target, target_trunk, source, (source_body.hips, *source_body.trunk))
    if source_body.neck:
        target_neck = (target_body.chest, *target_body.neck, target_body.head)
        source_neck = (*source_body.neck, source_body.head)
        if not source_body.arms_on_neck:
            source_neck = (source_body.chest, *source_neck)
        out |= _joints_along(target, target_neck, source, source_neck)
    for side in SIDES:
        for target_joint, source_joint in zip(target_body.arms[side], source_body.arms[side], strict=True):
            if target_joint is not None and source_joint is not None:
                out[target_joint] = source_joint
        for target_joint, source_joint in zip(target_body.legs[side], source_body.legs[side], strict=True):
            if target_joint is not None and source_joint is not None:
                out[target_joint] = source_joint
    return {target.joints[a]: source.joints[b] for a, b in sorted(out.items())}


def _joints_along(
    target: Skeleton, target_chain: Sequence[int], source: Skeleton, source_chain: Sequence[int]
) -> dict[int, int]:
    """Target joint -> source joint that it follows, by index, for two chains of joints in trunk or neck.

    The first joint of the target's chain is left out.
    """
    target_shares, source_shares = _shares(target, target_chain), _shares(source, source_chain)
    out = {target_chain[-1]: source_chain[-1]}
    for joint, share in zip(target_chain[1:-1], target_shares[1:-1], strict=True):
        below = [j for j, s in zip(source_chain[:-1], source_shares[:-1], strict=True) if s <= share + REACH]
        out[joint] = below[-1]
    return out


def _shares(skeleton: Skeleton, joints: Sequence[int]) -> Array:
    """How far along a chain of joints each joint is: 0 at the first, 1 at the last, by lengths of bones."""
    lengths = np.concatenate([[0.0], np.linalg.norm(skeleton.offsets[list(joints[1:])], axis=-1)])
    return np.cumsum(lengths) / max(float(lengths.sum()), 1e-9)
