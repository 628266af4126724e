"""Drives another rig with the poses of a character, in every frame of a game.

The functions are those of `hobble.motion.retarget`. A clip shows when a foot swings by its speed, a character
by its contacts.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from hobble.core import quat
from hobble.core.errors import HobbleError, InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, aim_bone, rest_positions
from hobble.motion.body import SIDES, body_by_roles, match_joints
from hobble.motion.read import decode_channels, read_bvh
from hobble.motion.rest_pose import why_not_standing
from hobble.motion.retarget import LIMB_BONES, Retarget, bend_legs, follow, level_pelvis, plan
from hobble.motion.rig import body_in_file, leg_length, likely_unit, match_rig
from hobble.motion.skeleton_file import KnownSkeleton, find_skeleton, load_skeleton, skeleton_folder

# Roles that a rig must have.
NEEDED = ("hips", "head", *(f"{s}_{p}" for s in SIDES for p in ("shoulder", "hip", "knee", "heel", "toe")))


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
    found = likely_unit(leg_length(rig))
    if found is None:
        raise InputError(
            path, f"no unit gives this rig a person's size: its legs are {leg_length(rig):g} long"
        )
    rig = replace(rig, offsets=found[0] * rig.offsets)
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
        self.skeleton, self.scale, self._how = how.target, how.scale, how
        self._joints, self._bones = _limb_bones(how)
        hips = how.target.role("hips")
        self._above = np.array([hips if p < 0 else how.drivers[p] for p in how.target.parents])
        depth = {hips: 0}  # joints of equal depth are placed together, from the hips outward
        while len(depth) < len(self._above):
            depth |= {j: depth[a] + 1 for j, a in enumerate(self._above) if a in depth and j not in depth}
        self._levels = [
            np.flatnonzero([depth[j] == n for j in range(len(depth))]) for n in sorted({*depth.values()})
        ]

    def __call__(self, positions: Array, rotations: Array, contacts: Array) -> tuple[Array, Array]:
        """Positions (C, K, 3) and rotations (C, K, 4) of the rig's K joints in the world, Hobble's axes, cm.

        positions (C, J, 3), rotations (C, J, 4): those of the character's joints. contacts: (C, 4) how much
        its left heel and toe and its right heel and toe are on the ground, 0 to 1. The path of the rig is
        that of the character times `scale`.
        """
        how, role = self._how, self._how.source.role
        turned = follow(how, rotations)
        # By positions, because predicted rotations do not quite lead to the predicted positions.
        joint, start, end = self._joints.T
        turned[:, joint] = aim_bone(turned[:, joint], self._bones, positions[:, end] - positions[:, start])
        how = level_pelvis(how, turned, positions[:, role("left_hip")] - positions[:, role("right_hip")])
        heights = [positions[:, role(f"{side}_toe"), 1] * how.scale for side in SIDES]
        ground = np.minimum(*heights)
        swings, heights = [1.0 - contacts[:, 1], 1.0 - contacts[:, 3]], [high - ground for high in heights]
        hips = bend_legs(how, positions, turned, swings, heights, lambda drop: drop)
        turned = turned[:, how.drivers]
        placed = np.empty((len(positions), len(self._above), 3))
        placed[:, self._levels[0]] = hips[:, None]
        for level in self._levels[1:]:
            above = self._above[level]
            placed[:, level] = placed[:, above] + quat.rotate(turned[:, above], how.driver_offsets[level])
        return placed, turned


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
    return np.array(joints), np.array(bones)
