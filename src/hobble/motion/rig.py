"""What a rig says about itself: its unit, its axes, where it faces, and which of the known skeletons it
is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton

# Centimetres per unit of the file; the CMU files count in inches / 0.45.
UNITS = {"cm": 1.0, "inch": 2.54, "m": 100.0, "mm": 0.1, "CMU": 5.6444, "foot": 30.48}
LEG = 80.0  # thigh and shank of an adult of ordinary size, cm
LEG_RANGE = (50.0, 125.0)
LIMBS = ("shoulder", "hip", "knee", "heel", "toe")
MANDATORY = ("hips", "head", *(f"{side}_{part}" for side in ("left", "right") for part in LIMBS))


@dataclass(frozen=True)
class Target:
    """A skeleton as its file describes it, with its maps to other skeletons."""

    skeleton: Skeleton
    maps: Mapping[str, Mapping[str, str]]


@dataclass(frozen=True)
class Match:
    """Which skeleton a clip's joints are those of, and how they carry over to the target.

    rig: the name of the skeleton file. roles: role -> the clip's joint. same: the clip is on the target
    itself. sources: the target's joint -> the clip's joint that it follows.
    """

    rig: str
    roles: Mapping[str, str]
    same: bool
    sources: Mapping[str, str]


def load_skeleton(path: str | Path, name: str | None = None) -> Target:
    """Read a skeleton file (`config/skeletons/<name>.yaml`, validated when the workflow starts)."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        data: dict[str, Any] = yaml.load(Path(path).read_text(encoding="utf-8"), loader)
        maps = data.pop("maps", None) or {}
        return Target(Skeleton.from_dict({**data, "name": name or Path(path).stem}), maps)
    except FileNotFoundError:
        raise InputError(path, "no such skeleton file") from None
    except (yaml.YAMLError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(path, f"not a skeleton file: {error}") from None


def clean_names(names: Sequence[str]) -> tuple[str, ...]:
    """Joint names without a prefix up to a colon ("mixamorig:Hips"), where they stay distinct."""
    short = tuple(name.rpartition(":")[2].strip() for name in names)
    return short if len(set(short)) == len(short) and all(short) else tuple(names)


def match_rig(path: Path, rig: Skeleton, target: Target, folder: str | Path) -> Match:
    """Find out which known skeleton a clip's rig is, and how it gets onto the target.

    rig: the clip's joints. folder: where the skeleton files lie, for their maps.
    Raises InputError that names what differs where the rig is neither the target nor mapped to it.
    """
    differences = _differences(rig, target.skeleton)
    if not differences:
        return Match(
            target.skeleton.name, target.skeleton.roles, True, {name: name for name in target.skeleton.joints}
        )
    best: Match | None = None
    for file in sorted(Path(folder).glob("*.yaml")):
        if file.stem == target.skeleton.name:
            continue
        known = load_skeleton(file)
        sources = _sources(rig, known, target)
        if sources and (best is None or len(sources) > len(best.sources)):
            best = Match(file.stem, _roles(rig, known.skeleton), False, sources)
    if best is None:
        shown = "; ".join(differences[:4]) + (
            f"; and {len(differences) - 4} more" if len(differences) > 4 else ""
        )
        raise InputError(
            path,
            f"another skeleton than {target.skeleton.name}, and no skeleton file maps it: {shown}",
            fix="Name the right skeleton in the data set, or add a map to config/skeletons/.",
        )
    return best


def _differences(rig: Skeleton, target: Skeleton) -> list[str]:
    """What keeps the rig from being the target, in words; empty where names and hierarchy agree."""
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


def _sources(rig: Skeleton, known: Target, target: Target) -> dict[str, str]:
    """Target joint -> the clip's joint, where the clip is on the skeleton `known`; empty where it is not.

    A rig may lack fingers or a nose of the known skeleton, but nothing that plays a mandatory role, and it
    may have joints that nobody knows, as long as they are fewer than those that are known.
    """
    roles = _roles(rig, known.skeleton)
    common = set(rig.joints) & set(known.skeleton.joints)
    if any(role not in roles for role in MANDATORY) or 2 * len(common) < len(rig.joints):
        return {}
    if not _same_order(rig, known.skeleton):
        return {}
    pairs = joint_pairs(known, target)
    return {mine: source for mine, source in pairs.items() if source in common}


def _same_order(rig: Skeleton, known: Skeleton) -> bool:
    """Whether the joints both have hang from one another in the same way."""

    def ancestors(skeleton: Skeleton) -> dict[str, str | None]:
        other = rig if skeleton is known else known
        out: dict[str, str | None] = {}
        for name, p in zip(skeleton.joints, skeleton.parents, strict=True):
            up = None if p < 0 else skeleton.joints[p]
            out[name] = up if up is None or up in other.joints else out[up]
        return out

    a, b = ancestors(rig), ancestors(known)
    return all(a[name] == b[name] for name in a if name in b)


def joint_pairs(source: Target, target: Target) -> dict[str, str]:
    """Target joint -> source joint, by the map of either to the other or of both to a third skeleton."""
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
    """Turn a map round; of several joints that go to one, the first in the file stands for it."""
    out: dict[str, str] = {}
    for a, b in pairs.items():
        out.setdefault(b, a)
    return out


def leg_length(skeleton: Skeleton, roles: Mapping[str, str] | None = None) -> float:
    """Length of thigh and shank together, mean of both sides, in the skeleton's unit."""
    roles = skeleton.roles if roles is None else roles
    bones = [skeleton.index(roles[f"{side}_{end}"]) for side in ("left", "right") for end in ("knee", "heel")]
    return float(np.linalg.norm(skeleton.offsets[bones], axis=-1).sum() / 2)


def unit_of(leg: float) -> tuple[float, str] | None:
    """Centimetres per unit and its name that make a leg of length `leg` an adult's; None where none does."""
    if leg <= 0:
        return None
    name = min(UNITS, key=lambda unit: abs(np.log(leg * UNITS[unit] / LEG)))
    return (UNITS[name], name) if LEG_RANGE[0] <= leg * UNITS[name] <= LEG_RANGE[1] else None
