"""The bind pose of a body: arms and legs are spread a little, so that no part of the body touches another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hobble.core import quat
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

SIDES = ("left", "right")
ARMS_DOWN = np.radians(60.0)  # angle of the arms below the horizontal
LEGS_OUT = np.radians(5.0)  # angle of the legs to the vertical
SHORTEST_BONE = 0.5  # cm; a shorter bone is not turned, because it hardly has a direction


@dataclass(frozen=True)
class BindPose:
    """World positions (J, 3) in cm and rotations (J, 4) of all joints.

    `bones`: role -> index of the joint that moves the part of the body below the role's place, such as the
    shank for "left_knee"; if the skeleton has no joint for the role, a joint near this place. `at`: role ->
    position (3,) of its joint, cm; estimated if there is no such joint.
    """

    positions: Array
    rotations: Array
    bones: dict[str, int]
    at: dict[str, Array]


def bind(skeleton: Skeleton) -> BindPose:
    """The bind pose of a skeleton. Its rest pose must stand and face +Z (see config/skeletons/README.md).

    Raises KeyError if a required role is missing: hips, head, and on both sides shoulder, hip, knee, heel and
    toe.
    """
    bones = _bones(skeleton)
    aims = _aims(bones)
    count = len(skeleton.joints)
    rotations, positions = np.tile(quat.IDENTITY, (count, 1)), np.zeros((count, 3))
    heels = {bones[f"{side}_heel"] for side in SIDES}  # the feet stay as in the rest pose
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
    at = {role: positions[skeleton.role(role)] for role in skeleton.roles if _has_role(skeleton, role)}
    return BindPose(positions, rotations, bones, _filled(at))


def _has_role(skeleton: Skeleton, role: str) -> bool:
    return skeleton.roles.get(role) in skeleton.joints


def _bones(skeleton: Skeleton) -> dict[str, int]:
    """`BindPose.bones` of a skeleton."""
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
    """The nearest common ancestor of two joints. If one of them is above the other, the upper one."""
    above = set(_chain(skeleton, b))
    return next(j for j in _chain(skeleton, a) if j in above)


def _first_below(skeleton: Skeleton, top: int, joint: int) -> int:
    """The first joint on the way from `top` down to `joint`; `joint` if `top` is not above it."""
    way = _chain(skeleton, joint)
    return way[way.index(top) - 1] if top in way[1:] else joint


def _rest_vector(skeleton: Skeleton, joint: int, below: int) -> Array:
    """Vector (3,) in the rest pose from a joint to the joint `below`; 0 if that is not a descendant."""
    way = _chain(skeleton, below)
    steps = way[: way.index(joint)] if joint in way else []
    return skeleton.offsets[steps].sum(axis=0) if steps else np.zeros(3)


def _aims(bones: dict[str, int]) -> dict[int, tuple[int, Array]]:
    """For joints of arms and legs: joint -> (joint below it, direction (3,) of the bone between them)."""
    out = {}
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        arm = np.array([sign * np.cos(ARMS_DOWN), -np.sin(ARMS_DOWN), 0.06])
        leg = np.array([sign * np.sin(LEGS_OUT), -np.cos(LEGS_OUT), 0.0])
        for a, b, direction in (
            ("shoulder", "elbow", arm), ("elbow", "wrist", arm), ("hip", "knee", leg), ("knee", "heel", leg),
        ):  # fmt: skip
            upper, lower = bones[f"{side}_{a}"], bones[f"{side}_{b}"]
            if upper != lower:
                out[upper] = (lower, direction / np.linalg.norm(direction))
    return out


def _filled(at: dict[str, Array]) -> dict[str, Array]:
    """Positions of all roles. The roles that the skeleton lacks are estimated from the others."""
    at = dict(at)
    middle = (at["left_shoulder"] + at["right_shoulder"]) / 2
    at.setdefault("neck", middle + 0.35 * (at["head"] - middle))
    at.setdefault("chest", at["hips"] + 0.62 * (at["neck"] - at["hips"]))
    at.setdefault("spine", at["hips"] + 0.45 * (at["chest"] - at["hips"]))
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        arm = np.array([sign * np.cos(ARMS_DOWN), -np.sin(ARMS_DOWN), 0.06])
        length = 0.33 * np.linalg.norm(at["hips"] - at[f"{side}_heel"])
        at.setdefault(f"{side}_elbow", at[f"{side}_shoulder"] + length * arm)
        at.setdefault(f"{side}_wrist", at[f"{side}_elbow"] + 0.85 * length * arm)
    return at
