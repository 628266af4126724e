"""Checks the content of a skeleton file. These are written by hand, so the line of a mistake is named."""

from __future__ import annotations

import re
from collections.abc import Mapping
from difflib import get_close_matches
from itertools import pairwise
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from hobble.core.errors import InputError
from hobble.core.untrusted import printable
from hobble.motion.body import SIDES, TRUNK
from hobble.motion.names import side_of
from hobble.motion.tree import above, common, path

FARTHEST = 1e5  # cm: each component of a joint's offset from its parent is at most this large
ARM, LEG = ("shoulder", "elbow", "wrist"), ("hip", "knee", "heel", "toe")
LIMBS = [tuple(f"{side}_{part}" for part in limb) for side in SIDES for limb in (ARM, LEG)]
ROLES = (*TRUNK, *(role for limb in LIMBS for role in limb))
# Roles that a file may leave out.
OPTIONAL = ("spine", "chest", "neck", "left_toe", "right_toe")
ORDER = "The order is hips, spine, chest, neck, head; shoulder, elbow, wrist; hip, knee, heel, toe."
APART = 0.25  # leg lengths: the joint from which the legs hang may be at most this far from the hips
ALIKE = ("spine", "chest")  # if the trunk has only one joint, this joint has both roles


class RigFile:
    """A skeleton file that is being checked.

    data: its content as plain data. text: its content as it is written, to find the line of a mistake.
    """

    def __init__(self, path: Path, data: Any, text: str) -> None:
        self.path, self.data, self.text = path, data, text

    def refuse(self, problem: str, section: str = "", name: str = "", fix: str | None = None) -> NoReturn:
        """Raise InputError. section, name: the mistake is in the line of key `name` of this section."""
        raise InputError(self.path, printable(problem, 400), line=self._line(section, name), fix=fix)

    def _line(self, section: str, name: str) -> int | None:
        inside, key = False, re.compile(rf"""^\s+(['"]?){re.escape(name)}\1\s*:""")
        for number, line in enumerate(self.text.split("\n"), 1):
            if re.match(r"\w", line):
                inside = line.startswith(f"{section}:") if section else False
                if inside and not name:
                    return number
            elif inside and key.match(line):
                return number
        return None


def check_rig_file(where: Path, data: Any, text: str) -> None:
    """Raise InputError if a skeleton file is wrong. The error names the line of the mistake if it is found.

    data: the content of the file as plain data. text: the content as it is written.

    Each joint but the first needs a parent that is listed above it, and each needs an offset of three
    numbers. Only the roles in ROLES are allowed, and no two may have the same joint (except spine and chest).
    Their joints must be in order from the trunk outward, and on the side that their names say. Hips, head,
    and on both sides shoulder, elbow, wrist, hip, knee and heel are required, and either both toes or none.
    Legs must hang from the hips, and arms from the chest or the neck.
    """
    file = RigFile(where, data, text)
    for key in ("joints", "roles"):
        if not isinstance(data, Mapping) or not isinstance(data.get(key), Mapping) or not data[key]:
            file.refuse(
                f"a skeleton file needs a section `{key}`", fix="config/skeletons/README.md describes it."
            )
    parents = _check_joints(file, data["joints"])
    _check_roles(file, data["roles"], parents)
    _check_order(file, data["roles"], parents)
    _check_hubs(file, data["roles"], parents)
    _check_sides(file, data["roles"])


def _check_joints(file: RigFile, joints: Mapping[Any, Any]) -> dict[str, int]:
    """Check the section `joints`. Returns each joint's name with the index of its parent, -1 for the root."""
    parents: dict[str, int] = {}
    numbers = {name: number for number, name in enumerate(joints)}
    for name, joint in joints.items():
        if not isinstance(name, str) or not isinstance(joint, Mapping):
            file.refuse(f"joint {name}: expected {{parent: ..., offset: [x, y, z]}}", "joints", str(name))
        parent, offset = joint.get("parent"), joint.get("offset")
        if parent is None and parents:
            file.refuse(f"joint {name}: only the first joint may have no parent", "joints", name)
        if parent is not None and (not isinstance(parent, str) or parent not in parents):
            file.refuse(f"joint {name}: its parent {parent!r} must be listed above it", "joints", name)
        if not _three_numbers(offset):
            problem = f"joint {name}: its offset must be three numbers of {FARTHEST:g} cm at most"
            file.refuse(problem, "joints", name)
        parents[name] = -1 if parent is None else numbers[parent]
    return parents


def _three_numbers(offset: Any) -> bool:
    numbers = isinstance(offset, list | tuple) and len(offset) == 3
    if not numbers or any(isinstance(x, bool) or not isinstance(x, int | float) for x in offset):
        return False
    return all(abs(x) <= FARTHEST for x in offset)


def _check_roles(file: RigFile, roles: Mapping[Any, Any], parents: Mapping[str, int]) -> None:
    """Check that the roles are known and complete, and that no two have the same joint."""
    owner: dict[str, str] = {}
    for role, joint in roles.items():
        if role not in ROLES:
            near = get_close_matches(str(role), ROLES, 1)
            more = f" (is it {near[0]}?)" if near else ""
            file.refuse(f"there is no role {role}{more}", "roles", str(role))
        if not isinstance(joint, str) or joint not in parents:
            near = get_close_matches(str(joint), list(parents), 1)
            more = f" (is it {near[0]!r}?)" if near else ""
            file.refuse(f"{role}: there is no joint {joint!r}{more}", "roles", role)
        if joint in owner and {role, owner[joint]} != set(ALIKE):
            file.refuse(f"{role} and {owner[joint]} are the same joint, {joint}", "roles", role)
        owner[joint] = role
    toes = [f"{side}_toe" for side in SIDES]
    needed = [role for role in ROLES if role not in OPTIONAL or (role in toes and set(toes) & set(roles))]
    missing = [role for role in needed if role not in roles]
    if missing:
        file.refuse(f"these roles are missing: {', '.join(missing)}", "roles")


def _check_order(file: RigFile, roles: Mapping[str, str], parents: Mapping[str, int]) -> None:
    """Check that each joint of a limb hangs from the one before it, and that the trunk is in order."""
    names, tree = list(parents), list(parents.values())
    for chain in (*LIMBS, TRUNK[1:]):
        for first, second in pairwise(role for role in chain if role in roles):
            higher, lower = roles[first], roles[second]
            if higher not in (names[j] for j in above(tree, names.index(lower))):
                problem = f"{second} is {lower}, which does not hang from {higher}, the {first}"
                file.refuse(problem, "roles", second, ORDER)
    hips = {names[j] for j in above(tree, names.index(roles["hips"]))[1:]}
    for role, joint in roles.items():
        if joint in hips:
            problem = f"hips is {roles['hips']}, which hangs from {joint}, the {role}"
            file.refuse(problem, "roles", "hips", ORDER)


def _check_hubs(file: RigFile, roles: Mapping[str, str], parents: Mapping[str, int]) -> None:
    """Check that the arms hang from the chest or the neck, and the legs from a joint near the hips."""
    names, tree = list(parents), list(parents.values())

    def hub(part: str) -> int:
        return common(tree, [names.index(roles[f"{side}_{part}"]) for side in SIDES])

    arms, legs = hub("shoulder"), hub("hip")
    trunk = [names.index(roles[role]) for role in ("chest", "neck") if role in roles]
    if "chest" in roles and arms not in trunk:
        file.refuse(f"chest is {roles['chest']}, but the arms hang from {names[arms]}", "roles", "chest")
    offsets = {name: np.array(joint["offset"], float) for name, joint in file.data["joints"].items()}
    between = path(tree, names.index(roles["hips"]), legs)[1:]
    way = sum(float(np.linalg.norm(offsets[names[j]])) for j in between)
    leg = sum(float(np.linalg.norm(offsets[roles[f"left_{part}"]])) for part in ("knee", "heel"))
    if way > APART * leg:
        file.refuse(f"hips is {roles['hips']}, but the legs hang from {names[legs]}", "roles", "hips")


def _check_sides(file: RigFile, roles: Mapping[str, str]) -> None:
    """Check that no joint of one side has a name of the other."""
    for role, joint in roles.items():
        side, named = role.partition("_")[0], side_of(joint)
        if side in SIDES and named is not None and named != side:
            file.refuse(
                f"{role} is {joint}, whose name says {named}",
                "roles",
                role,
                "Swap the joints. If the name is wrong, rename the joint here and in the clips.",
            )
