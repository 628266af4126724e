"""Identifies the rig of a BVH file, maps it to the target skeleton, and finds its unit.

A rig is the skeleton in a BVH file. A known skeleton is one that has a file in `config/skeletons`.
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
from hobble.motion.check_rig_file import check_rig_file
from hobble.motion.tree import path

# Centimetres per unit of the file. The unit of CMU files is an inch / 0.45.
UNITS = {"cm": 1.0, "inch": 2.54, "m": 100.0, "mm": 0.1, "CMU": 5.6444, "foot": 30.48}
LEG = 80.0  # cm: length of thigh plus shank of an average adult
KNOWN = 0.75  # a known skeleton is a clip's rig if it has at least this share of the clip's joint names
# Finds the names of joints (and other keys) in the text of a skeleton file.
NAME = re.compile(r"^ +['\"]?([^\s'\":{}][^'\":{}]*)['\"]?\s*:", re.MULTILINE)
# Role at the end of a bone -> degrees. Two rest poses count as equal if no bone differs by more than this.
LIKE = {"elbow": 20.0, "wrist": 25.0, "knee": 35.0, "heel": 35.0, "toe": 35.0}
LEG_RANGE = (35.0, 125.0)  # cm: length of thigh plus shank, from small children to giants
# Roles that every rig must have.
LIMBS = ("shoulder", "hip", "knee", "heel", "toe")
MANDATORY = ("hips", "head", *(f"{side}_{part}" for side in ("left", "right") for part in LIMBS))


@dataclass(frozen=True)
class TargetSkeleton:
    """A known skeleton, read from its file, with its maps to other skeletons.

    maps: name of the other skeleton -> {joint of this one: joint of the other}.
    """

    skeleton: Skeleton
    maps: Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class RigMatch:
    """Which known skeleton a clip's rig is, and how it maps to the target.

    rig: name of the known skeleton, or "found" if the joints' roles were found without one. roles: role ->
    the clip's joint. same: whether the clip has the target's own joints and an equal rest pose. sources: the
    target's joint -> the clip's joint that it follows. alike: whether the clip's rest pose equals that of the
    known skeleton.
    """

    rig: str
    roles: Mapping[str, str]
    same: bool
    sources: Mapping[str, str]
    alike: bool = True


def load_skeleton(path: str | Path, name: str | None = None) -> TargetSkeleton:
    """Read a skeleton file (`config/skeletons/<name>.yaml`). Raises InputError if it is missing or wrong."""
    if not Path(path).is_file():
        raise InputError(path, "no such skeleton file")
    state = Path(path).stat()
    return _loaded(Path(path), name or Path(path).stem, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=32)
def _loaded(path: Path, name: str, changed: int, size: int) -> TargetSkeleton:
    """Read a skeleton file.

    The arguments `changed` and `size` make the cache read it again after a change.
    """
    data: Any = read_yaml(path)
    check_rig_file(path, data, read_text(path))
    try:
        maps = data.pop("maps", None) or {}
        skeleton = Skeleton.from_dict({**data, "name": name})
        return TargetSkeleton(skeleton, maps)
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise InputError(path, f"not a skeleton file: {printable(error)}") from None


def nearest(names: Collection[str], target: TargetSkeleton, folder: str | Path) -> TargetSkeleton:
    """The skeleton in `folder` that has the most of these joint names; the target if none has more.

    A file whose text shows that it cannot have more of them is not parsed, because parsing YAML takes longer
    than reading most clips.
    """
    best, found = len(set(names) & set(target.skeleton.joints)), target
    for file in sorted(Path(folder).glob("*.yaml")):
        written = set(NAME.findall(read_text(file)))
        if file.stem == target.skeleton.name or len(set(names) & written) <= best:
            continue
        other = load_skeleton(file)
        if (shared := len(set(names) & set(other.skeleton.joints))) > best:
            best, found = shared, other
    return found


def clean_names(names: Sequence[str]) -> tuple[str, ...]:
    """Joint names without a prefix like "mixamorig:"; unchanged if two names would become equal."""
    short = tuple(name.rpartition(":")[2].strip() for name in names)
    return short if len(set(short)) == len(short) and all(short) else tuple(names)


def find_hips(names: Sequence[str], target: TargetSkeleton, folder: str | Path) -> int:
    """Index of a clip's hips. This is needed because some programs export a joint above the hips.

    The name of the hips is taken from the known skeleton that has the most of the clip's joint names. If the
    clip has no joint of this name, its root counts as the hips. folder: the folder of the skeleton files.
    """
    if names[0] == target.skeleton.roles["hips"]:
        return 0
    hips = nearest(names, target, folder).skeleton.roles["hips"]
    return names.index(hips) if hips in names else 0


def match_rig(rig: Skeleton, target: TargetSkeleton, folder: str | Path) -> RigMatch | None:
    """Find which known skeleton a clip's rig is, and how it maps to the target.

    rig: the clip's skeleton. folder: the folder of the skeleton files. Returns None if no skeleton file has
    the rig's joint names. If no map leads to the target, the match has roles but no sources.
    """
    if not _differences(rig, target.skeleton):
        roles = target.skeleton.roles
        alike = rest_alike(replace(rig, roles=roles), target.skeleton)
        itself = {name: name for name in target.skeleton.joints}
        return RigMatch(target.skeleton.name, roles, same=alike, sources=itself, alike=alike)
    known = nearest(rig.joints, target, folder)
    if _share_of_names(rig, known.skeleton) < KNOWN or _unfit(rig, known.skeleton):
        return None
    roles = _roles(rig, known.skeleton)
    if _trunk(rig, roles) != _trunk(known.skeleton, known.skeleton.roles):
        # With fewer or more joints in the spine, names like Neck may mean other joints than in the file.
        return RigMatch(known.skeleton.name, roles, same=False, sources={}, alike=False)
    sources = {a: b for a, b in joint_pairs(known, target).items() if b in rig.joints}
    alike = rest_alike(replace(rig, roles=roles), known.skeleton)
    return RigMatch(known.skeleton.name, roles, same=False, sources=sources, alike=alike)


def rest_alike(rig: Skeleton, known: Skeleton) -> bool:
    """Whether the bones of two rest poses have equal directions. Turned or mirrored bodies count as equal.

    A rig without toe joints (the balls of the feet) never counts as equal, because they have to be added.
    """
    if "left_toe" not in rig.roles:
        return False
    of_rig, of_known = (_bones(skeleton) for skeleton in (rig, known))
    for bone, direction in of_known.items():
        if bone in of_rig and of_rig[bone] @ direction < np.cos(np.radians(LIKE[bone[1].partition("_")[2]])):
            return False
    return True


def _bones(skeleton: Skeleton) -> dict[tuple[str, str], Array]:
    """(role, role) -> unit direction (3,) of the bone between them: to the body's left, up and forward."""
    at = rest_positions(skeleton)
    place = {role: at[skeleton.role(role)] for role in skeleton.roles}
    left = place["left_hip"] - place["right_hip"] + place["left_shoulder"] - place["right_shoulder"]
    up = place["head"] - place["hips"]
    feet = sum(place[f"{side}_toe"] - place[f"{side}_heel"] for side in ("left", "right"))
    axes: list[Array] = []
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
    """Share of the clip's joints, 0 to 1, whose names also occur in a known skeleton."""
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
    names = skeleton.joints
    return {n: names[p] if p >= 0 else None for n, p in zip(names, skeleton.parents, strict=True)}


def _roles(rig: Skeleton, known: Skeleton) -> dict[str, str]:
    return {role: joint for role, joint in known.roles.items() if joint in rig.joints}


def _trunk(skeleton: Skeleton, roles: Mapping[str, str]) -> list[str]:
    """The names of the joints from the hips to the head."""
    ends = (skeleton.index(roles[role]) for role in ("hips", "head"))
    return [skeleton.joints[j] for j in path(skeleton.parents, *ends)]


def _unfit(rig: Skeleton, known: Skeleton) -> list[str]:
    """Why a rig cannot be treated as a known skeleton, in words; empty if it can.

    The rig may lack fingers or eyes, but no mandatory role. It may have unknown joints.
    """
    roles = _roles(rig, known)
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


def joint_pairs(source: TargetSkeleton, target: TargetSkeleton) -> dict[str, str]:
    """Target joint -> source joint, by a map of one skeleton to the other, or by maps of both to a third."""
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
    """Invert a map. If several joints map to the same joint, the first of them in the file counts."""
    out: dict[str, str] = {}
    for a, b in pairs.items():
        out.setdefault(b, a)
    return out


def leg_length(skeleton: Skeleton, roles: Mapping[str, str] | None = None) -> float:
    """Length of thigh and shank together, mean of both sides, in the skeleton's unit."""
    roles = skeleton.roles if roles is None else roles
    bones = [skeleton.index(roles[f"{side}_{end}"]) for side in ("left", "right") for end in ("knee", "heel")]
    return float(np.linalg.norm(skeleton.offsets[bones], axis=-1).sum() / 2)


def missing_bone(skeleton: Skeleton) -> str | None:
    """The first leg bone without length, such as "LeftUpLeg to LeftLeg", or None."""
    for side in ("left", "right"):
        for start, end in (("hip", "knee"), ("knee", "heel")):
            a, b = (skeleton.roles[f"{side}_{part}"] for part in (start, end))
            if np.linalg.norm(skeleton.offsets[skeleton.index(b)]) < 1e-6:
                return f"{a} to {b}"
    return None


def unit_of(leg: float) -> tuple[float, str] | None:
    """The unit in which a leg of length `leg` is nearest to an adult's: (centimetres per unit, name).

    None if no unit gives a leg within LEG_RANGE.
    """
    if leg <= 0:
        return None
    name = min(UNITS, key=lambda unit: abs(np.log(leg * UNITS[unit] / LEG)))
    return (UNITS[name], name) if LEG_RANGE[0] <= leg * UNITS[name] <= LEG_RANGE[1] else None
