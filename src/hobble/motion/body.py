"""The parts of a body on a rig: the joints of trunk, limbs and head, and where its hands point."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, common_ancestor, path_between, path_to_root
from hobble.motion.names import part_of

SIDES = ("left", "right")
# Roles of joints. Those of a limb begin with the side, as in "left_knee".
TRUNK = ("hips", "spine", "chest", "neck", "head")
ARM, LEG = ("shoulder", "elbow", "wrist"), ("hip", "knee", "heel", "toe")
# In retargeting, each joint of the target's trunk follows a joint of the source's trunk. This joint may be
# higher, by up to this share of the trunk's length. The same holds for the neck.
REACH = 0.2
AWAY = (0.1, 0.7)  # range of the distance from the wrist to the base of a finger, in forearm lengths
# Forearm lengths. A finger that is shorter than the longest finger by less than this counts as equally long.
EQUAL = 0.03


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
    arms: Mapping[str, tuple[Any, ...]]
    legs: Mapping[str, tuple[Any, ...]]
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
    def spine(self) -> tuple[int, ...]:
        """The joints from the hips to the head."""
        return (self.hips, *self.trunk, *self.neck, self.head)

    @property
    def chains(self) -> list[tuple[int, ...]]:
        """The chains of joints of a body: the spine, then each limb, after the joint that carries it."""
        out = [self.spine]
        for side in SIDES:
            out += [(self.chest, *self.arms[side]), (self.hips, *self.legs[side])]
        return [tuple(j for j in chain if j is not None) for chain in out]

    @property
    def joints(self) -> list[int]:
        """All joints of the body except the fingers, parents first."""
        spine, *limbs = self.chains
        return [*spine, *(j for limb in limbs for j in limb[1:])]

    @property
    def limb_bones(self) -> list[tuple[int, int]]:
        """The bones of legs, feet and arms, as pairs (joint at the start, joint at the end), no clavicles."""
        limbs = (limb for side in SIDES for limb in (self.legs[side], self.arms[side][1:]))
        return [bone for limb in limbs for bone in pairwise(j for j in limb if j is not None)]

    def renumbered(self, new: Mapping[int, int]) -> Body:
        """The same body with other joint indices.

        new: index -> new index. It must contain all `joints`. Fingers that it does not contain are left out.
        """
        arms, legs = (
            {side: tuple(None if j is None else new[j] for j in limb) for side, limb in limbs.items()}
            for limbs in (self.arms, self.legs)
        )
        trunk, neck = (tuple(new[j] for j in chain) for chain in (self.trunk, self.neck))
        fingers = {side: new[j] for side, j in self.fingers.items() if j in new}
        return Body(new[self.hips], trunk, neck, new[self.head], arms, legs, fingers, self.arms_on_neck)

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
            joints = zip((*ARM, *LEG), (*self.arms[side][1:], *self.legs[side]), strict=True)
            out |= {f"{side}_{part}": names[j] for part, j in joints if j is not None}
        return out


def middle(positions: Array, limbs: Mapping[str, tuple[Any, ...]], k: int) -> Array:
    """(..., 3) the point between the left and the right k-th joints of the arms or the legs of a Body.

    positions: (..., J, 3) of the joints.
    """
    return 0.5 * (positions[..., limbs["left"][k], :] + positions[..., limbs["right"][k], :])


def across(positions: Array, limbs: Mapping[str, tuple[Any, ...]], k: int) -> Array:
    """(..., 3) vectors from the right to the left of these joints."""
    return positions[..., limbs["left"][k], :] - positions[..., limbs["right"][k], :]


def body_by_roles(skeleton: Skeleton) -> Body:
    """The body of a skeleton whose roles are known.

    The other joints of trunk, neck and clavicles are those that lie between joints with roles in the
    hierarchy. The skeleton needs the roles hips and head, and on both sides shoulder, elbow, wrist, hip, knee
    and heel.
    """
    parents, at = skeleton.parents, {role: skeleton.role(role) for role in skeleton.roles}
    hips, head = at["hips"], at["head"]
    shoulders = [at[f"{side}_shoulder"] for side in SIDES]
    chest = at.get("chest", common_ancestor(parents, shoulders))
    trunk = [j for j in path_between(parents, hips, chest) if j != hips]
    neck = [j for j in path_between(parents, chest, head) if j not in (chest, head, hips, *trunk)]
    arms, legs = {}, {}
    for side, shoulder in zip(SIDES, shoulders, strict=True):
        taken = {chest, shoulder, *trunk, *neck}
        clavicles = [None, *(j for j in path_between(parents, chest, shoulder) if j not in taken)]
        arms[side] = (clavicles[-1], *(at[f"{side}_{part}"] for part in ARM))
        legs[side] = tuple(at.get(f"{side}_{part}") for part in LEG)
    return with_fingers(Body(hips, tuple(trunk), tuple(neck), head, arms, legs), skeleton)


def with_fingers(body: Body, skeleton: Skeleton) -> Body:
    """The body with `fingers` filled in, by the joints' offsets and names."""
    return replace(body, fingers=pointing_fingers(skeleton, {s: arm[3] for s, arm in body.arms.items()}))


def match_joints(source: Skeleton, source_body: Body, target: Skeleton, target_body: Body) -> dict[str, str]:
    """Name of a target joint -> name of the source joint that it follows in retargeting.

    source_body, target_body: the bodies on the skeletons `source` and `target`. The hips, the chest, the head
    and each joint of a limb follow the same part of the source's body. Each other joint of the trunk follows
    the highest source joint below a limit, which is a fifth of the trunk (REACH) above the joint itself.
    Joints of the neck are matched in the same way. Target joints without a counterpart are left out.
    """
    out: dict[int, int] = {target_body.hips: source_body.hips, target_body.head: source_body.head}
    trunks = [(body.hips, *body.trunk) for body in (target_body, source_body)]
    out |= _joints_along(target, trunks[0], source, trunks[1])
    if source_body.neck:
        necks = [(body.chest, *body.neck, body.head) for body in (target_body, source_body)]
        out |= _joints_along(target, necks[0], source, necks[1][int(source_body.arms_on_neck) :])
    for side in SIDES:
        follower, leader = ((*body.arms[side], *body.legs[side]) for body in (target_body, source_body))
        pairs = zip(follower, leader, strict=True)
        out |= {a: b for a, b in pairs if a is not None and b is not None}
    return {target.joints[a]: source.joints[b] for a, b in sorted(out.items())}


def _joints_along(
    target: Skeleton, target_chain: Sequence[int], source: Skeleton, source_chain: Sequence[int]
) -> dict[int, int]:
    """Target joint -> source joint that it follows, by index, for two chains of joints in trunk or neck.

    The first joint of the target's chain is left out.
    """
    target_shares, source_shares = (
        distance_shares(np.linalg.norm(skeleton.offsets[list(chain[1:])], axis=-1))
        for skeleton, chain in ((target, target_chain), (source, source_chain))
    )
    out = {target_chain[-1]: source_chain[-1]}
    for joint, share in zip(target_chain[1:-1], target_shares[1:-1], strict=True):
        lower = max(len(source_chain) - 1, 1)  # a rig without a trunk has only the hips
        below = [j for j, s in zip(source_chain[:lower], source_shares, strict=False) if s <= share + REACH]
        out[joint] = below[-1]
    return out


def distance_shares(lengths: Array) -> Array:
    """(N,) how far along a chain of bones each of N joints is: 0 at the first, 1 at the last.

    lengths: (N-1,) of the bones.
    """
    distances = np.concatenate([[0.0], np.cumsum(lengths)])
    return distances / max(float(distances[-1]), 1e-9)


def pointing_fingers(skeleton: Skeleton, wrists: Mapping[str, int]) -> dict[str, int]:
    """Side -> index of the joint at the base of the hand's longest finger. Hands without one are left out.

    wrists: side -> index of the wrist's joint. A thumb does not count. A chain longer than the forearm does
    not count either, because it is an object in the hand. Fingers whose names say that they point where the
    hand does (like the index finger) are preferred. If several fingers are about as long as the longest, the
    middle one of these is taken.
    """
    fingers = {}
    for side, wrist in wrists.items():
        forearm = float(np.linalg.norm(skeleton.offsets[wrist]))
        found = _possible_fingers(skeleton, wrist, forearm)
        if found:
            longest = max(length for length, _, _ in found)
            places = {base: place for length, base, place in found if length > longest - EQUAL * forearm}
            centre = np.mean(list(places.values()), axis=0)
            fingers[side] = min(places, key=lambda base: float(np.linalg.norm(places[base] - centre)))
    return fingers


def _possible_fingers(skeleton: Skeleton, wrist: int, forearm: float) -> list[tuple[float, int, Array]]:
    """For each chain below the wrist that can be a finger: its length, its base, and where the base lies.

    The base is the index of a joint. Its place is a (3,) position relative to the wrist. If the names say
    that a finger points where the hand does, the length of the forearm is added to the finger's, so that all
    other fingers are shorter. forearm: length of the forearm.
    """
    paths = (path_to_root(skeleton.parents, end) for end in range(len(skeleton.joints)))
    chains = [path[: path.index(wrist)][::-1] for path in paths if wrist in path[1:]]
    texts = ["|".join(skeleton.joints[j] for j in chain).lower() for chain in chains]
    numbers = [_finger_number(text) for text in texts]
    # The lowest number is the thumb's. A single number does not show whether its finger is the thumb.
    known = {number for number in numbers if number is not None}
    thumb = min(known) if len(known) > 1 else None
    found = []
    for chain, text, number in zip(chains, texts, numbers, strict=True):
        if "thumb" in text or (number is not None and number == thumb):
            continue
        length = float(np.linalg.norm(skeleton.offsets[chain], axis=-1).sum())
        places = np.cumsum(skeleton.offsets[chain], axis=0)
        distances = np.linalg.norm(places, axis=-1)
        in_range = np.flatnonzero((distances > AWAY[0] * forearm) & (distances < AWAY[1] * forearm))
        parts = {part_of(skeleton.joints[j]) for j in chain}
        is_hand = part_of(skeleton.joints[wrist]) == "wrist" and "hand" in parts
        points_like_hand = "index" in text or "middle" in text or is_hand or number is not None
        if len(in_range) and length < forearm:
            base = int(in_range[0])
            found.append((length + forearm * points_like_hand, chain[base], places[base]))
    return found


def _finger_number(names: str) -> int | None:
    """The number of a finger in its joints' names: 2 in "LeftFinger2Proximal", 0 in "Bip01 L Finger01"."""
    match = re.search(r"finger[ _.]*(\d)", names, re.IGNORECASE)
    return int(match[1]) if match else None
