"""Drives another rig with the poses of a character, in every frame of a game.

`hobble.motion.retarget.plan` says which joints of the rig follow which joints of the character, and how. Here
a compiled function applies this plan to poses.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.compiled import njit
from hobble.core.errors import HobbleError, InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion.body import SIDES, body_by_roles, match_joints
from hobble.motion.read import decode_channels, read_bvh
from hobble.motion.rest_pose import why_not_standing
from hobble.motion.retarget import BENT, LIMB_BONES, MOST_DROP, NEARLY_STRAIGHT, SPARED, Retarget, plan
from hobble.motion.rig import body_in_file, leg_length, likely_unit, match_rig
from hobble.motion.skeleton_file import KnownSkeleton, find_skeleton, load_skeleton, skeleton_folder
from hobble.runtime.leg import leg_joints, move_heel, rotation_between, turn_rotation, turn_vector

# Roles that a rig must have.
NEEDED = ("hips", "head", *(f"{s}_{p}" for s in SIDES for p in ("shoulder", "hip", "knee", "heel", "toe")))
LEAST_AHEAD = 0.1  # cm: a rig's knee is at least this far ahead of the line between hip and heel


def load_rig(file: str | Path) -> KnownSkeleton:
    """The rig of a skeleton file, of a file of config/skeletons by its name, or of a BVH file.

    The rest pose of a BVH file is its zero pose, in which a person must be able to stand. Its motion is only
    used to find out which joint is which part of the body. Raises InputError for other files.
    """
    path = Path(file)
    if path.suffix.lower() != ".bvh":
        return load_skeleton(find_skeleton(str(file)))
    raw, _ = decode_channels(read_bvh(path))
    known = match_rig(raw.skeleton, load_rig("holden31"), skeleton_folder())
    body, _ = body_in_file(path, raw, known, "auto")
    rig = replace(raw.skeleton, roles=body.roles(raw.skeleton.joints))
    length = leg_length(rig)
    unit = likely_unit(length) if length > 0 else None
    if unit is None:
        raise InputError(path, f"no unit gives this rig a person's size: its legs are {length:g} long")
    rig = replace(rig, offsets=unit * rig.offsets)
    if problem := why_not_standing(body, rest_positions(rig)):
        raise InputError(path, f"its zero pose is no rest pose: {problem}")
    return KnownSkeleton(rig, {})


def plan_rig(
    source: Skeleton, rig: Skeleton | KnownSkeleton | str | Path, joints: Mapping[str, str] | None = None
) -> Retarget:
    """How a rig follows a character's skeleton.

    source: the character's skeleton. rig: a skeleton with roles, or a file that `load_rig` reads. joints:
    name of a rig's joint -> name of the character's joint that it follows. By default, the rig's file may
    have such a map for the character's skeleton; otherwise joints are matched by their parts of the body.
    Raises HobbleError for a rig without a joint of NEEDED, without a leg bone, or whose legs follow nothing.
    """
    known = load_rig(rig) if isinstance(rig, str | Path) else rig
    known = KnownSkeleton(known, {}) if isinstance(known, Skeleton) else known
    target = known.skeleton
    if missing := [role for role in NEEDED if role not in target.roles]:
        raise HobbleError(f"the rig {target.name} has no joint for {', '.join(missing)}")
    followed = joints or known.maps.get(source.name)
    if followed is None or not set(followed.values()) <= set(source.joints):
        if joints:
            unknown = sorted(set(joints.values()) - set(source.joints))
            raise HobbleError(f"the character has no joint {', '.join(unknown)}: {', '.join(source.joints)}")
        followed = match_joints(source, body_by_roles(source), target, body_by_roles(target))
    return plan(source, target, followed)


class RigDriver:
    """Drives the rig of a plan. Calling it turns poses of the character into poses of the rig.

    how: from `plan_rig`. `skeleton` is the rig's, `scale` its leg length divided by that of the character.
    """

    def __init__(self, how: Retarget) -> None:
        target, hips = how.target, how.target.role("hips")
        self.skeleton, self.scale = target, how.scale
        own = np.zeros(len(target.joints), bool)
        own[how.joints] = True
        above = [hips if p < 0 else how.drivers[p] for p in target.parents]
        self._followed = np.stack([how.joints, how.follows], axis=1).astype(np.int64), how.turns
        self._joints = np.array(above, np.int64), own, how.driver_offsets, hips
        legs = leg_joints(target).astype(np.int64), leg_joints(how.source).astype(np.int64)
        self._body = *legs, how.pelvis, how.forward, float(how.scale), np.asarray(how.lifts, float)
        self._limbs = _limb_bones(how)

    def __call__(self, positions: Array, rotations: Array) -> tuple[Array, Array]:
        """Positions (C, K, 3) and rotations (C, K, 4) of the rig's K joints in the world, Hobble's axes, cm.

        positions (C, J, 3), rotations (C, J, 4): those of the character's joints. The path of the rig is that
        of the character times `scale`.
        """
        shape = len(positions), len(self.skeleton.joints)
        out = np.empty((*shape, 3)), np.empty((*shape, 4))
        drive_rig(positions, rotations, self._followed, self._joints, self._limbs, self._body, *out)
        return out


def _limb_bones(how: Retarget) -> tuple[np.ndarray, Array]:
    """The limb bones that both bodies have: (B, 3) joints and (B, 3) bones in the rig's rest pose, cm.

    The joints are the rig's at the start of the bone, and the character's at its start and end.
    """
    target, source, rest = how.target, how.source, rest_positions(how.target)
    joints, bones = [], []
    for side in SIDES:
        for start, end in ((f"{side}_{a}", f"{side}_{b}") for a, b in LIMB_BONES.items()):
            if all(role in skeleton.roles for role in (start, end) for skeleton in (target, source)):
                joints.append((target.role(start), source.role(start), source.role(end)))
                bones.append(rest[target.role(end)] - rest[target.role(start)])
    return np.array(joints, np.int64), np.array(bones, float)


@njit
def drive_rig(
    source: Any, turned: Any, followed: Any, joints: Any, limbs: Any, body: Any, position: Any, rotation: Any
) -> None:
    """Write the poses of a rig into position (C, K, 3) and rotation (C, K, 4).

    source (C, J, 3), turned (C, J, 4): positions and rotations of the character's joints. followed, joints,
    body: see `RigDriver`; limbs: see `_limb_bones`. As in `hobble.motion.retarget`: rotations follow the
    character's, limbs have the directions of its limbs, the hips are where they are in the scaled character,
    come down if a leg would be straighter than the character's, and legs bend until the balls of the feet are
    where they are in the scaled character.
    """
    (pairs, turns), (_, _, offsets, hips), (ends, limb_bones) = followed, joints, limbs
    legs, leading, pelvis, forward, scale, lifts = body
    shift, by = np.zeros((2, 3)), np.empty(4)
    lift = 0.5 * (lifts[0] + lifts[1])
    for c in range(len(position)):
        p, q, s = position[c], rotation[c], source[c]
        for i in range(len(pairs)):
            q[pairs[i, 0]] = turns[i]
            turn_rotation(turned[c, pairs[i, 1]], q[pairs[i, 0]])
        for i in range(len(ends)):
            # By positions, because predicted rotations do not quite lead to the predicted positions.
            j, wanted = ends[i, 0], s[ends[i, 2]] - s[ends[i, 1]]
            x, y, z = turn_vector(q[j], limb_bones[i, 0], limb_bones[i, 1], limb_bones[i, 2])
            by[0], by[1], by[2], by[3] = rotation_between(x, y, z, wanted[0], wanted[1], wanted[2])
            turn_rotation(by, q[j])
        x, y, z = turn_vector(q[hips], pelvis[0], pelvis[1], pelvis[2])
        left, right = s[leading[0, 0]], s[leading[1, 0]]  # the character's hip joints
        p[hips, 0] = 0.5 * scale * (left[0] + right[0]) - x
        p[hips, 1] = 0.5 * scale * (left[1] + right[1]) - y + lift
        p[hips, 2] = 0.5 * scale * (left[2] + right[2]) - z
        _place_joints(p, q, joints)
        drop = 0.0
        for f in range(2):
            hip, heel, toe = legs[f, 0], legs[f, 2], legs[f, 3]
            x, y, z = turn_vector(q[heel], offsets[toe, 0], offsets[toe, 1], offsets[toe, 2])
            ball = s[leading[f, 3]]
            shift[f, 0], shift[f, 2] = scale * ball[0] - x, scale * ball[2] - z
            shift[f, 1] = scale * ball[1] + lift - lifts[f] - y
            bones = _length(offsets[legs[f, 1]]), _length(offsets[heel])
            drop = max(drop, _drop(p[hip], shift[f], bones, s, leading[f]))
            shift[f] -= p[heel]
        p[:, 1] -= drop
        shift[:, 1] += drop
        for f in range(2):
            hip, knee, heel = legs[f, 0], legs[f, 1], legs[f, 2]
            thigh, shank = p[knee] - p[hip], p[heel] - p[knee]
            ahead = turn_vector(q[hip], forward[0], forward[1], forward[2])
            move_heel(p, hip, knee, heel, shift[f], ahead, LEAST_AHEAD)
            _turn_along(q[hip], thigh, p[knee] - p[hip], by)
            _turn_along(q[knee], shank, p[heel] - p[knee], by)
        _place_joints(p, q, joints)


@njit
def _place_joints(position: Any, rotation: Any, joints: Any) -> None:
    """Place the joints of a rig from its hips and the rotations of the joints that follow the character.

    Other joints get the rotation of the joint above them.
    """
    above, own, offsets, hips = joints
    for j in range(len(position)):
        if j != hips:
            a = above[j]
            x, y, z = turn_vector(rotation[a], offsets[j, 0], offsets[j, 1], offsets[j, 2])
            position[j, 0], position[j, 1], position[j, 2] = (
                position[a, 0] + x, position[a, 1] + y, position[a, 2] + z
            )  # fmt: skip
            if not own[j]:
                rotation[j] = rotation[a]


@njit
def _turn_along(rotation: Any, old: Any, new: Any, by: Any) -> None:
    """Turn a joint's rotation (4,) in place by the smallest rotation from the bone `old` to `new` (3,)."""
    by[0], by[1], by[2], by[3] = rotation_between(old[0], old[1], old[2], new[0], new[1], new[2])
    turn_rotation(by, rotation)


@njit
def _length(v: Any) -> float:
    return np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@njit
def _drop(hip: Any, ankle: Any, bones: tuple[float, float], source: Any, leg: Any) -> float:
    """How far the hips must come down for the rig's knee to bend as the character's does, cm.

    hip: (3,) where the rig's leg begins. ankle: (3,) where it must end. bones: lengths of the rig's thigh and
    shank. source: (J, 3) the character's joints. leg: (4,) the joints of its leg. See `_Leg.excess` in
    `hobble.motion.retarget`.
    """
    thigh, shank = source[leg[1]] - source[leg[0]], source[leg[2]] - source[leg[1]]
    upper, lower = max(_length(thigh), 1e-9), max(_length(shank), 1e-9)
    cosine = (thigh[0] * shank[0] + thigh[1] * shank[1] + thigh[2] * shank[2]) / (upper * lower)
    bend = max(np.arccos(min(max(cosine, -1.0), 1.0)) - SPARED, 0.0)
    reach = bones[0] ** 2 + bones[1] ** 2 + 2 * bones[0] * bones[1] * np.cos(bend)  # squared
    level = min((hip[0] - ankle[0]) ** 2 + (hip[2] - ankle[2]) ** 2, reach)
    need = max(hip[1] - ankle[1] - np.sqrt(reach - level), 0.0)
    stretch = _length(source[leg[2]] - source[leg[0]]) / (upper + lower)
    share = min(max((stretch - BENT) / (NEARLY_STRAIGHT - BENT), 0.0), 1.0)
    return min(need, MOST_DROP) * share * share * (3.0 - 2.0 * share)
