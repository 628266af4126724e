"""Identifies the rig of a BVH file, maps it to the target skeleton, and finds its unit.

A rig is the skeleton in a BVH file. A known skeleton is one that has a file in `config/skeletons`. The target
is the known skeleton to which clips are retargeted. A role is the body part of a joint, such as "left_knee".
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.core.untrusted import printable, read_text, read_yaml
from hobble.motion.check_skeleton_file import check_skeleton_file
from hobble.motion.tree import path_between

# Name of a unit of length -> centimetres. The unit of CMU files is an inch / 0.45.
UNITS = {"cm": 1.0, "inch": 2.54, "m": 100.0, "mm": 0.1, "CMU": 5.6444, "foot": 30.48}
LEG = 80.0  # cm: length of thigh plus shank of an average adult
# A rig is taken for a known skeleton only if at least this share of the rig's joint names occur in that
# skeleton.
LEAST_SHARED_NAMES = 0.75
# Finds the names of joints (and other indented keys) in the text of a skeleton file.
NAME = re.compile(r"^ +['\"]?([^\s'\":{}][^'\":{}]*)['\"]?\s*:", re.MULTILINE)
# Role at the end of a bone, without the side -> degrees. Two rest poses count as equal if no bone's direction
# differs by more than this.
MOST_APART = {"elbow": 20.0, "wrist": 25.0, "knee": 35.0, "heel": 35.0, "toe": 35.0}
LEG_RANGE = (35.0, 125.0)  # cm: length of thigh plus shank, from small children to giants
# Roles that a rig must have if the known skeleton has them.
LIMBS = ("shoulder", "hip", "knee", "heel", "toe")
MANDATORY = ("hips", "head", *(f"{side}_{part}" for side in ("left", "right") for part in LIMBS))


@dataclass(frozen=True)
class KnownSkeleton:
    """A known skeleton, read from its file, with its maps to other skeletons.

    maps: name of another skeleton -> {joint of this skeleton: joint of the other}.
    """

    skeleton: Skeleton
    maps: Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class RigMatch:
    """Which known skeleton a clip's rig is, and how it maps to the target.

    rig: name of the known skeleton, or UNKNOWN_RIG of `hobble.motion.make`. roles: role -> name of the
    clip's joint. is_target_skeleton: whether the clip has the target's own joints and an equal rest pose.
    followed_joints: name of a target joint -> name of the clip's joint that it follows. has_known_rest_pose:
    whether the clip's rest pose equals that of the known skeleton (as `has_equal_rest_pose` compares them);
    False if the rig has other joints between hips and head.
    """

    rig: str
    roles: Mapping[str, str]
    is_target_skeleton: bool
    followed_joints: Mapping[str, str]
    has_known_rest_pose: bool = True


def load_skeleton(path: str | Path, name: str | None = None) -> KnownSkeleton:
    """Read a skeleton file (`config/skeletons/<name>.yaml`). Raises InputError if it is missing or wrong."""
    if not Path(path).is_file():
        raise InputError(path, "no such skeleton file")
    state = Path(path).stat()
    return _load_cached(Path(path), name or Path(path).stem, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=32)
def _load_cached(path: Path, name: str, changed: int, size: int) -> KnownSkeleton:
    """Read a skeleton file, or return what was read before.

    changed, size: time of the last change and size of the file. They are part of the cache's key, so that a
    changed file is read again.
    """
    data: Any = read_yaml(path)
    check_skeleton_file(path, data, read_text(path))
    try:
        maps = data.pop("maps", None) or {}
        skeleton = Skeleton.from_dict({**data, "name": name})
        return KnownSkeleton(skeleton, maps)
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(path, f"not a skeleton file: {printable(error)}") from None


def nearest_skeleton(names: Collection[str], target: KnownSkeleton, folder: str | Path) -> KnownSkeleton:
    """The skeleton in `folder` that has the most of these joint names; the target if none has more.

    A skeleton file is not parsed if its text shows that it has no more of these names than the best skeleton
    so far, because parsing YAML takes longer than reading most clips.
    """
    best, found = len(set(names) & set(target.skeleton.joints)), target
    for file in sorted(Path(folder).glob("*.yaml")):
        in_text = set(NAME.findall(read_text(file)))
        if file.stem == target.skeleton.name or len(set(names) & in_text) <= best:
            continue
        other = load_skeleton(file)
        if (shared := len(set(names) & set(other.skeleton.joints))) > best:
            best, found = shared, other
    return found


def clean_names(names: Sequence[str]) -> tuple[str, ...]:
    """Joint names without a prefix like "mixamorig:"; unchanged if two names would become equal."""
    short = tuple(name.rpartition(":")[2].strip() for name in names)
    return short if len(set(short)) == len(short) and all(short) else tuple(names)


def find_hips(names: Sequence[str], target: KnownSkeleton, folder: str | Path) -> int:
    """Index of the hips among a clip's joints: not always 0, as some programs export a joint above the hips.

    names: of the clip's joints, the root first. folder: the folder of the skeleton files. The name of the
    hips is taken from the known skeleton that has the most of the clip's joint names. If the clip has no
    joint of this name, its root counts as the hips.
    """
    if names[0] == target.skeleton.roles["hips"]:
        return 0
    hips = nearest_skeleton(names, target, folder).skeleton.roles["hips"]
    return names.index(hips) if hips in names else 0


def match_rig(rig: Skeleton, target: KnownSkeleton, folder: str | Path) -> RigMatch | None:
    """Find which known skeleton a clip's rig is, and how it maps to the target.

    rig: the clip's skeleton. folder: the folder of the skeleton files. The known skeleton that shares most
    joint names with the rig is tried. Returns None if it shares too few, if the rig lacks one of its
    mandatory joints, or if the hierarchies differ. The match has roles but no `followed_joints` if no map
    leads to the target, or if the rig has other joints between hips and head than the known skeleton.
    """
    if not _differences(rig, target.skeleton):
        roles = target.skeleton.roles
        alike = has_equal_rest_pose(replace(rig, roles=roles), target.skeleton)
        itself = {name: name for name in target.skeleton.joints}
        return RigMatch(
            target.skeleton.name,
            roles,
            is_target_skeleton=alike,
            followed_joints=itself,
            has_known_rest_pose=alike,
        )
    known = nearest_skeleton(rig.joints, target, folder)
    if _share_of_names(rig, known.skeleton) < LEAST_SHARED_NAMES or _misfits(rig, known.skeleton):
        return None
    roles = _roles_in_rig(rig, known.skeleton)
    if _trunk_joints(rig, roles) != _trunk_joints(known.skeleton, known.skeleton.roles):
        # With other joints in the spine, a name such as Neck may mean another joint than in the file of the
        # known skeleton.
        return RigMatch(
            known.skeleton.name,
            roles,
            is_target_skeleton=False,
            followed_joints={},
            has_known_rest_pose=False,
        )
    followed_joints = {a: b for a, b in joint_pairs(known, target).items() if b in rig.joints}
    alike = has_equal_rest_pose(replace(rig, roles=roles), known.skeleton)
    return RigMatch(
        known.skeleton.name,
        roles,
        is_target_skeleton=False,
        followed_joints=followed_joints,
        has_known_rest_pose=alike,
    )


def has_equal_rest_pose(rig: Skeleton, known: Skeleton) -> bool:
    """Whether the limb bones of two rest poses have equal directions, to within MOST_APART.

    Directions are measured in the body's own axes, so turned or mirrored bodies count as equal. A rig
    without toe joints (the balls of the feet) never counts as equal, so that it gets a new rest pose. Then
    toe joints are added.
    """
    if "left_toe" not in rig.roles:
        return False
    of_rig, of_known = (_bone_directions(skeleton) for skeleton in (rig, known))
    for bone, direction in of_known.items():
        if bone in of_rig and of_rig[bone] @ direction < np.cos(
            np.radians(MOST_APART[bone[1].partition("_")[2]])
        ):
            return False
    return True


def _bone_directions(skeleton: Skeleton) -> dict[tuple[str, str], Array]:
    """(role at the start, role at the end) of each limb bone -> its unit direction (3,).

    The components of a direction are along the body's left, up and forward.
    """
    at = rest_positions(skeleton)
    place = {role: at[skeleton.role(role)] for role in skeleton.roles}
    left = place["left_hip"] - place["right_hip"] + place["left_shoulder"] - place["right_shoulder"]
    up = place["head"] - place["hips"]
    feet = sum(place[f"{side}_toe"] - place[f"{side}_heel"] for side in ("left", "right"))
    axes: list[Array] = []  # made orthonormal in this order (Gram-Schmidt)
    for axis in (left, up, feet):
        for other in axes:
            axis = axis - other * (axis @ other)
        axes.append(axis / max(float(np.linalg.norm(axis)), 1e-9))
    out = {}
    for side in ("left", "right"):
        for chain in (("shoulder", "elbow", "wrist"), ("hip", "knee", "heel", "toe")):
            for a, b in pairwise(f"{side}_{part}" for part in chain):
                if a in place and b in place:
                    bone = np.array(axes) @ (place[b] - place[a])
                    out[a, b] = bone / max(float(np.linalg.norm(bone)), 1e-9)
    return out


def _share_of_names(rig: Skeleton, known: Skeleton) -> float:
    """Share of the rig's joints, 0 to 1, whose names also occur in a known skeleton."""
    return len(set(rig.joints) & set(known.joints)) / len(rig.joints)


def _differences(rig: Skeleton, target: Skeleton) -> list[str]:
    """How the rig differs from the target, in words. Empty if names and hierarchy agree."""
    in_rig, in_target = _parent_names(rig), _parent_names(target)
    differences = [f"joint {name} is missing" for name in in_target if name not in in_rig]
    differences += [f"joint {name} is not in the skeleton" for name in in_rig if name not in in_target]
    differences += [
        f"joint {name} hangs from {in_rig[name]}, not from {parent}"
        for name, parent in in_target.items()
        if name in in_rig and in_rig[name] != parent
    ]
    return differences


def _parent_names(skeleton: Skeleton) -> dict[str, str | None]:
    """Name of each joint -> name of its parent, None for the root."""
    names = skeleton.joints
    return {n: names[p] if p >= 0 else None for n, p in zip(names, skeleton.parents, strict=True)}


def _roles_in_rig(rig: Skeleton, known: Skeleton) -> dict[str, str]:
    """Role -> name of its joint, for those roles of a known skeleton whose joints the rig has."""
    return {role: joint for role, joint in known.roles.items() if joint in rig.joints}


def _trunk_joints(skeleton: Skeleton, roles: Mapping[str, str]) -> list[str]:
    """The names of the joints from the hips to the head."""
    ends = (skeleton.index(roles[role]) for role in ("hips", "head"))
    return [skeleton.joints[j] for j in path_between(skeleton.parents, *ends)]


def _misfits(rig: Skeleton, known: Skeleton) -> list[str]:
    """Why a rig cannot be treated as a known skeleton, in words; empty if it can.

    The rig may lack fingers or eyes, but no mandatory role. It may have joints that the skeleton lacks.
    """
    roles = _roles_in_rig(rig, known)
    needed = [role for role in MANDATORY if role in known.roles]
    missing = [f"joint {known.roles[role]} ({role}) is missing" for role in needed if role not in roles]
    in_rig, in_known = _common_parents(rig, known), _common_parents(known, rig)
    return missing + [
        f"joint {name} hangs from {in_rig[name]}, not from {parent}"
        for name, parent in in_known.items()
        if in_rig[name] != parent
    ]


def _common_parents(skeleton: Skeleton, other: Skeleton) -> dict[str, str | None]:
    """For each joint that is in both skeletons, the nearest joint above it in `skeleton` that is in both."""
    above: dict[str, str | None] = {}
    for name, p in zip(skeleton.joints, skeleton.parents, strict=True):
        up = None if p < 0 else skeleton.joints[p]
        above[name] = up if up is None or up in other.joints else above[up]
    return {name: up for name, up in above.items() if name in other.joints}


def joint_pairs(source: KnownSkeleton, target: KnownSkeleton) -> dict[str, str]:
    """Name of a target joint -> name of the source joint that it follows.

    The pairs come from a map of one skeleton to the other, or from maps of both to a third skeleton. Without
    such maps, the result is empty.
    """
    source_name, target_name = source.skeleton.name, target.skeleton.name
    if source_name == target_name:
        return {name: name for name in target.skeleton.joints}
    if source_name in target.maps:
        return dict(target.maps[source_name])
    if target_name in source.maps:
        return _reverse(source.maps[target_name])
    for hub in source.maps:
        if hub in target.maps:
            to_source = _reverse(source.maps[hub])
            return {a: to_source[b] for a, b in target.maps[hub].items() if b in to_source}
    return {}


def _reverse(pairs: Mapping[str, str]) -> dict[str, str]:
    """Invert a map. If several joints map to the same joint, the first of them in the map counts."""
    out: dict[str, str] = {}
    for a, b in pairs.items():
        out.setdefault(b, a)
    return out


def leg_length(skeleton: Skeleton, roles: Mapping[str, str] | None = None) -> float:
    """Length of thigh and shank together, mean of both sides, in the skeleton's unit.

    roles: role -> name of its joint; by default the skeleton's own.
    """
    roles = skeleton.roles if roles is None else roles
    bones = [skeleton.index(roles[f"{side}_{end}"]) for side in ("left", "right") for end in ("knee", "heel")]
    return float(np.linalg.norm(skeleton.offsets[bones], axis=-1).sum() / 2)


def missing_bone(skeleton: Skeleton) -> str | None:
    """The first leg bone without length, such as "LeftUpLeg to LeftLeg"; None if all have a length."""
    for side in ("left", "right"):
        for start, end in (("hip", "knee"), ("knee", "heel")):
            a, b = (skeleton.roles[f"{side}_{part}"] for part in (start, end))
            if np.linalg.norm(skeleton.offsets[skeleton.index(b)]) < 1e-6:
                return f"{a} to {b}"
    return None


def likely_unit(leg: float) -> tuple[float, str] | None:
    """The likely unit of a file: centimetres per unit, and the name of the unit.

    leg: length of thigh plus shank in the file's unit. The unit is the one that brings this length
    nearest to LEG. None if it is not within LEG_RANGE even then.
    """
    if leg <= 0:
        return None
    name = min(UNITS, key=lambda unit: abs(np.log(leg * UNITS[unit] / LEG)))
    return (UNITS[name], name) if LEG_RANGE[0] <= leg * UNITS[name] <= LEG_RANGE[1] else None
