"""The bind pose: the pose in which the body is built. Arms and legs are spread, so that no parts touch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

SIDES = ("left", "right")
ARMS_DOWN = np.radians(60.0)  # angle of the arms below the horizontal
LEGS_OUT = np.radians(5.0)  # angle between the legs and the vertical
SHORTEST_BONE = 0.5  # cm; a shorter bone is not turned, because it hardly has a direction


@dataclass(frozen=True)
class BindPose:
    """World positions (J, 3) in cm and rotations (J, 4) of all joints.

    joint_of: role -> index of the joint that moves the part of the body below it. For "left_knee", this part
    is the shank. If the skeleton has no joint for a role, the index is that of a joint near by. position_of:
    role -> position (3,) of its joint, cm. It is estimated if the skeleton has no joint for the role.
    """

    positions: Array
    rotations: Array
    joint_of: dict[str, int]
    position_of: dict[str, Array]


def bind_pose(skeleton: Skeleton) -> BindPose:
    """The bind pose of a skeleton. Its rest pose must stand and face +Z (see config/skeletons/README.md).

    Raises KeyError if a required role is missing: hips, head, and on both sides shoulder, hip, knee, heel and
    toe.
    """
    joint_of = _find_bones(skeleton)
    aims = _bone_directions(joint_of)
    count = len(skeleton.joints)
    rotations, positions = np.tile(quat.IDENTITY, (count, 1)), np.zeros((count, 3))
    heels = {joint_of[f"{side}_heel"] for side in SIDES}  # the feet stay as in the rest pose
    for j, p in enumerate(skeleton.parents):
        if p >= 0:
            rotations[j] = rotations[p]
            positions[j] = positions[p] + quat.rotate(rotations[p], skeleton.offsets[j])
        if j in heels:
            rotations[j] = quat.IDENTITY
        elif j in aims:
            below, direction = aims[j]
            bone = quat.rotate(rotations[j], _rest_vector(skeleton, j, below))
            if np.linalg.norm(bone) > SHORTEST_BONE:
                rotations[j] = quat.mul(quat.between(bone, direction), rotations[j])
    known = {role: positions[skeleton.role(role)] for role in skeleton.roles if _has_role(skeleton, role)}
    return BindPose(positions, rotations, joint_of, _with_missing_roles(known))


def _has_role(skeleton: Skeleton, role: str) -> bool:
    """Whether the skeleton has a joint for a role."""
    return skeleton.roles.get(role) in skeleton.joints


def _find_bones(skeleton: Skeleton) -> dict[str, int]:
    """`BindPose.joint_of` for a skeleton."""
    found = {role: skeleton.role(role) for role in skeleton.roles if _has_role(skeleton, role)}
    hips = found["hips"]
    found.setdefault("neck", max(skeleton.parents[found["head"]], 0))
    found.setdefault("chest", _common_joint(skeleton, found["left_shoulder"], found["right_shoulder"]))
    found.setdefault("spine", _first_below(skeleton, hips, found["chest"]))
    for side in SIDES:
        found.setdefault(f"{side}_elbow", found[f"{side}_shoulder"])
        found.setdefault(f"{side}_wrist", found[f"{side}_elbow"])
        for role in ("hip", "knee", "heel", "toe"):
            skeleton.role(f"{side}_{role}")  # raises KeyError with the name of the missing role
    return found


def _chain(skeleton: Skeleton, joint: int) -> list[int]:
    """The joint and all its ancestors, nearest first."""
    out = [joint]
    while skeleton.parents[out[-1]] >= 0:
        out.append(skeleton.parents[out[-1]])
    return out


def _common_joint(skeleton: Skeleton, a: int, b: int) -> int:
    """The nearest common ancestor of joints a and b, or one of them if it is above the other."""
    above = set(_chain(skeleton, b))
    return next(j for j in _chain(skeleton, a) if j in above)


def _first_below(skeleton: Skeleton, top: int, joint: int) -> int:
    """The first joint on the way from `top` down to `joint`; `joint` itself if `top` is not above it."""
    way = _chain(skeleton, joint)
    return way[way.index(top) - 1] if top in way[1:] else joint


def _rest_vector(skeleton: Skeleton, joint: int, below: int) -> Array:
    """Vector (3,) in the rest pose from a joint to its descendant `below`, cm; 0 if it is no descendant."""
    way = _chain(skeleton, below)
    steps = way[: way.index(joint)] if joint in way else []
    return skeleton.offsets[steps].sum(axis=0) if steps else np.zeros(3)


def _bone_directions(joint_of: dict[str, int]) -> dict[int, tuple[int, Array]]:
    """For joints of arms and legs: joint -> (joint below it, direction (3,) of the bone between them)."""
    out = {}
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):  # the left side is at +X
        # The arms point a little to the front (+Z).
        arm = np.array([sign * np.cos(ARMS_DOWN), -np.sin(ARMS_DOWN), 0.06])
        leg = np.array([sign * np.sin(LEGS_OUT), -np.cos(LEGS_OUT), 0.0])
        for a, b, direction in (
            ("shoulder", "elbow", arm), ("elbow", "wrist", arm), ("hip", "knee", leg), ("knee", "heel", leg),
        ):  # fmt: skip
            upper, lower = joint_of[f"{side}_{a}"], joint_of[f"{side}_{b}"]
            if upper != lower:
                out[upper] = (lower, direction / np.linalg.norm(direction))
    return out


def _with_missing_roles(known: dict[str, Array]) -> dict[str, Array]:
    """`BindPose.position_of` from the positions of the roles that the skeleton has.

    The positions of the missing roles are estimated. The factors are rough proportions of a person.
    """
    out = dict(known)
    middle = (out["left_shoulder"] + out["right_shoulder"]) / 2
    out.setdefault("neck", middle + 0.35 * (out["head"] - middle))
    out.setdefault("chest", out["hips"] + 0.62 * (out["neck"] - out["hips"]))
    out.setdefault("spine", out["hips"] + 0.45 * (out["chest"] - out["hips"]))
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        arm = np.array([sign * np.cos(ARMS_DOWN), -np.sin(ARMS_DOWN), 0.06])
        upper_arm = 0.33 * np.linalg.norm(out["hips"] - out[f"{side}_heel"])  # length, cm
        out.setdefault(f"{side}_elbow", out[f"{side}_shoulder"] + upper_arm * arm)
        out.setdefault(f"{side}_wrist", out[f"{side}_elbow"] + 0.85 * upper_arm * arm)
    return out
