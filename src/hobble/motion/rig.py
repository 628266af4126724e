"""Finds which known skeleton the rig (the skeleton of a file) is, how it maps to the target, and its unit."""

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
LEG = 80.0  # cm: length of thigh and shank of an average adult
KNOWN = 0.75  # a skeleton is a clip's rig if it has at least this share of the joint names
# A joint's name in a skeleton file.
NAME = re.compile(r"^ +['\"]?([^\s'\":{}][^'\":{}]*)['\"]?\s*:", re.MULTILINE)
# Two rest poses count as equal if bones differ by at most this many degrees, by the role at the bone's end.
LIKE = {"elbow": 20.0, "wrist": 25.0, "knee": 35.0, "heel": 35.0, "toe": 35.0}
LEG_RANGE = (35.0, 125.0)  # cm: from small children to giants
LIMBS = ("shoulder", "hip", "knee", "heel", "toe")
MANDATORY = ("hips", "head", *(f"{side}_{part}" for side in ("left", "right") for part in LIMBS))


@dataclass(frozen=True)
class TargetSkeleton:
    """A skeleton as in its file, with its maps to other skeletons."""

    skeleton: Skeleton
    maps: Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class RigMatch:
    """Which known skeleton a clip's rig is, and how it maps to the target.

    rig: name of the skeleton file. roles: role -> the clip's joint. same: whether the clip's rig is the
    target itself. sources: the target's joint -> the clip's joint that it follows. alike: whether the rest
    pose of the clip equals that of the skeleton file.
    """

    rig: str
    roles: Mapping[str, str]
    same: bool
    sources: Mapping[str, str]
    alike: bool = True


def load_skeleton(path: str | Path, name: str | None = None) -> TargetSkeleton:
    """Read a skeleton file (`config/skeletons/<name>.yaml`). It is validated when the workflow starts."""
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
    """The skeleton file in `folder` that has most of the names; the target if no file has more than it.

    A file whose text cannot contain more of the names is not parsed, because parsing YAML takes longer than
    reading most clips.
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
    """Joint names without a prefix like "mixamorig:", unless they become ambiguous without it."""
    short = tuple(name.rpartition(":")[2].strip() for name in names)
    return short if len(set(short)) == len(short) and all(short) else tuple(names)


def find_hips(names: Sequence[str], target: TargetSkeleton, folder: str | Path) -> int:
    """Index of a clip's hips, by the known skeleton that has most of its names; else that of the root.

    It is needed because some programs export a joint above the hips. folder: that of the skeleton files.
    """
    if names[0] == target.skeleton.roles["hips"]:
        return 0
    hips = nearest(names, target, folder).skeleton.roles["hips"]
    return names.index(hips) if hips in names else 0


def match_rig(rig: Skeleton, target: TargetSkeleton, folder: str | Path) -> RigMatch | None:
    """Find which known skeleton a clip's rig is, and how it maps to the target.

    rig: the clip's joints. folder: the folder of the skeleton files, for their maps. Returns None if no
    skeleton file has the rig's names. If no map leads to the target, the match has roles but no sources.
    """
    if not _differences(rig, target.skeleton):
        roles = target.skeleton.roles
        alike = rest_alike(replace(rig, roles=roles), target.skeleton)
        same = {name: name for name in target.skeleton.joints}
        return RigMatch(target.skeleton.name, roles, alike, same, alike)
    known = nearest(rig.joints, target, folder)
    if _share(rig, known.skeleton) < KNOWN or _unfit(rig, known.skeleton):
        return None
    roles = _roles(rig, known.skeleton)
    if _trunk(rig, roles) != _trunk(known.skeleton, known.skeleton.roles):
        # With fewer or more joints in the spine, names like Neck may mean other joints than in the file.
        return RigMatch(known.skeleton.name, roles, False, {}, False)
    sources = {a: b for a, b in joint_pairs(known, target).items() if b in rig.joints}
    alike = rest_alike(replace(rig, roles=roles), known.skeleton)
    return RigMatch(known.skeleton.name, roles, False, sources, alike)


def rest_alike(rig: Skeleton, known: Skeleton) -> bool:
    """Whether the bones of two rest poses have equal directions. Turned or mirrored bodies count as equal.

    A rig without toes never counts as equal, because its balls of the feet have to be added.
    """
    if "left_toe" not in rig.roles:
        return False
    mine, theirs = (_bones(skeleton) for skeleton in (rig, known))
    for bone, wanted in theirs.items():
        if bone in mine and mine[bone] @ wanted < np.cos(np.radians(LIKE[bone[1].partition("_")[2]])):
            return False
    return True


def _bones(skeleton: Skeleton) -> dict[tuple[str, str], Array]:
    """(role, role) -> direction of the bone between, as components to the body's left, up and forward."""
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


def _share(rig: Skeleton, known: Skeleton) -> float:
    """Share of the clip's joints, 0 to 1, that have names of a known skeleton."""
    return len(set(rig.joints) & set(known.joints)) / len(rig.joints)


def _differences(rig: Skeleton, target: Skeleton) -> list[str]:
    """How the rig differs from the target, in words. Empty if names and hierarchy agree."""
    mine, wanted = _parent_names(rig), _parent_names(target)
    found = [f"joint {name} is missing" for name in wanted if name not in mine]
    found += [f"joint {name} is not in the skeleton" for name in mine if name not in wanted]
    found += [
        f"joint {name} hangs from {mine[name]}, not from {parent}"
        for name, parent in wanted.items()
        if name in mine and mine[name] != parent
    ]
    return found


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
    """Why a rig cannot be treated as a known one, in words; empty if it can.

    It may lack fingers or eyes, but no mandatory role. It may have unknown joints.
    """
    roles = _roles(rig, known)
    needed = [role for role in MANDATORY if role in known.roles]
    found = [f"joint {known.roles[role]} ({role}) is missing" for role in needed if role not in roles]
    mine, wanted = _nearest(rig, known), _nearest(known, rig)
    return found + [
        f"joint {n} hangs from {mine[n]}, not from {p}" for n, p in wanted.items() if mine[n] != p
    ]


def _nearest(skeleton: Skeleton, other: Skeleton) -> dict[str, str | None]:
    """For each joint of both skeletons the nearest joint above it that is in both."""
    above: dict[str, str | None] = {}
    for name, p in zip(skeleton.joints, skeleton.parents, strict=True):
        up = None if p < 0 else skeleton.joints[p]
        above[name] = up if up is None or up in other.joints else above[up]
    return {name: up for name, up in above.items() if name in other.joints}


def joint_pairs(source: TargetSkeleton, target: TargetSkeleton) -> dict[str, str]:
    """Target joint -> source joint, by the map of either to the other, or of both to a third skeleton."""
    mine, theirs = source.skeleton.name, target.skeleton.name
    if mine == theirs:
        return {name: name for name in target.skeleton.joints}
    if mine in target.maps:
        return dict(target.maps[mine])
    if theirs in source.maps:
        return _reverse(source.maps[theirs])
    for hub in source.maps:
        if hub in target.maps:
            to_source = _reverse(source.maps[hub])
            return {a: to_source[b] for a, b in target.maps[hub].items() if b in to_source}
    return {}


def _reverse(pairs: Mapping[str, str]) -> dict[str, str]:
    """Invert a map. If several joints map to one, the first in the file counts."""
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
    """(centimetres per unit, name of the unit) in which a leg of length `leg` is nearest to an adult's.

    None if no unit gives a length within LEG_RANGE.
    """
    if leg <= 0:
        return None
    name = min(UNITS, key=lambda unit: abs(np.log(leg * UNITS[unit] / LEG)))
    return (UNITS[name], name) if LEG_RANGE[0] <= leg * UNITS[name] <= LEG_RANGE[1] else None
