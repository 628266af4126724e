"""Checks the content of a skeleton file (`config/skeletons/<name>.yaml`).

The file lists the joints of a rig, and tells which joint has which role. A role names a part of the body.
Users write these files by hand, so each error names the line of the mistake.
"""

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
from hobble.motion.tree import lowest_common_ancestor, path_between, path_to_root

FARTHEST = 1e5  # cm: each component of a joint's offset from its parent is at most this large
# The roles of one arm and one leg, from the trunk outward.
ARM, LEG = ("shoulder", "elbow", "wrist"), ("hip", "knee", "heel", "toe")
LIMBS = [tuple(f"{side}_{part}" for part in limb) for side in SIDES for limb in (ARM, LEG)]
ROLES = (*TRUNK, *(role for limb in LIMBS for role in limb))  # all that there are
# Roles that a file may leave out.
OPTIONAL = ("spine", "chest", "neck", "left_toe", "right_toe")
# Advice in error messages.
ORDER = (
    "The order in the trunk is hips, spine, chest, neck, head; in an arm shoulder, elbow, wrist; in a leg "
    "hip, knee, heel, toe."
)
APART = 0.25  # leg lengths: the joint from which the legs hang may be at most this far from the hips
MAY_SHARE = ("spine", "chest")  # if the trunk has only one joint, this joint has both roles


class SkeletonFile:
    """A skeleton file that is being checked.

    data: its content as plain data. text: its content as it is written, to find the line of a mistake.
    """

    def __init__(self, path: Path, data: Any, text: str) -> None:
        self.path, self.data, self.text = path, data, text

    def refuse(self, problem: str, section: str = "", name: str = "", fix: str | None = None) -> NoReturn:
        """Raise InputError with the line of the mistake.

        section, name: the mistake is in the line of the key `name` of this section, or in the line of the
        section's own key if `name` is empty.
        """
        raise InputError(self.path, printable(problem, 400), line=self._line(section, name), fix=fix)

    def _line(self, section: str, name: str) -> int | None:
        """Number (from 1) of the line that `refuse` names, or None if it is not found."""
        inside, key = False, re.compile(rf"""^\s+(['"]?){re.escape(name)}\1\s*:""")
        for number, line in enumerate(self.text.split("\n"), 1):
            if re.match(r"\w", line):
                inside = line.startswith(f"{section}:") if section else False
                if inside and not name:
                    return number
            elif inside and key.match(line):
                return number
        return None


def check_skeleton_file(where: Path, data: Any, text: str) -> None:
    """Raise InputError if a skeleton file is wrong. The error names the line of the mistake if it is found.

    data: the content of the file as plain data. text: the content as it is written.

    Each joint but the first needs a parent that is listed above it. Each joint needs an offset of three
    numbers. Only the roles in ROLES are allowed, and no two roles may have the same joint (except spine and
    chest). The joints of the roles must be in order from the trunk outward, and a name that says a side must
    say the side of the joint's role. Hips, head, and on both sides shoulder, elbow, wrist, hip, knee and heel
    are required. Either both toes or none must be there. The legs must hang from a joint at or near the
    hips. If there is a chest, the arms must hang from it or from the neck.
    """
    file = SkeletonFile(where, data, text)
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


def _check_joints(file: SkeletonFile, joints: Mapping[Any, Any]) -> dict[str, int]:
    """Check the section `joints`. Returns joint -> index of its parent, -1 for the root."""
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
        if not _is_offset(offset):
            problem = f"joint {name}: its offset must be three numbers of {FARTHEST:g} cm at most"
            file.refuse(problem, "joints", name)
        parents[name] = -1 if parent is None else numbers[parent]
    return parents


def _is_offset(offset: Any) -> bool:
    """Whether a value is a list of three numbers that are not larger than FARTHEST."""
    is_triple = isinstance(offset, list | tuple) and len(offset) == 3
    if not is_triple or any(isinstance(x, bool) or not isinstance(x, int | float) for x in offset):
        return False
    return all(abs(x) <= FARTHEST for x in offset)


def _check_roles(file: SkeletonFile, roles: Mapping[Any, Any], parents: Mapping[str, int]) -> None:
    """Check that the roles are known and complete, and that no two have the same joint.

    parents: joint -> index of its parent.
    """
    role_of: dict[str, str] = {}
    for role, joint in roles.items():
        if role not in ROLES:
            near = get_close_matches(str(role), ROLES, 1)
            guess = f" (is it {near[0]}?)" if near else ""
            file.refuse(f"there is no role {role}{guess}", "roles", str(role))
        if not isinstance(joint, str) or joint not in parents:
            near = get_close_matches(str(joint), list(parents), 1)
            guess = f" (is it {near[0]!r}?)" if near else ""
            file.refuse(f"{role}: there is no joint {joint!r}{guess}", "roles", role)
        if joint in role_of and {role, role_of[joint]} != set(MAY_SHARE):
            file.refuse(f"{role} and {role_of[joint]} are the same joint, {joint}", "roles", role)
        role_of[joint] = role
    toes = [f"{side}_toe" for side in SIDES]
    needed = [role for role in ROLES if role not in OPTIONAL or (role in toes and set(toes) & set(roles))]
    missing = [role for role in needed if role not in roles]
    if missing:
        file.refuse(f"these roles are missing: {', '.join(missing)}", "roles")


def _check_order(file: SkeletonFile, roles: Mapping[str, str], parents: Mapping[str, int]) -> None:
    """Check that each joint of a limb or of the trunk hangs from the joint before it.

    The hips must not hang from a joint that has a role.
    """
    names, tree = list(parents), list(parents.values())  # tree: the index of each joint's parent
    for chain in (*LIMBS, TRUNK[1:]):
        for first, second in pairwise(role for role in chain if role in roles):
            higher, lower = roles[first], roles[second]
            if higher not in (names[j] for j in path_to_root(tree, names.index(lower))):
                problem = f"{second} is {lower}, which does not hang from {higher}, the {first}"
                file.refuse(problem, "roles", second, ORDER)
    above_hips = {names[j] for j in path_to_root(tree, names.index(roles["hips"]))[1:]}
    for role, joint in roles.items():
        if joint in above_hips:
            problem = f"hips is {roles['hips']}, which hangs from {joint}, the {role}"
            file.refuse(problem, "roles", "hips", ORDER)


def _check_hubs(file: SkeletonFile, roles: Mapping[str, str], parents: Mapping[str, int]) -> None:
    """Check that the arms hang from the chest or the neck, and the legs from a joint near the hips."""
    names, tree = list(parents), list(parents.values())  # tree: the index of each joint's parent

    def hub(part: str) -> int:
        # The joint from which the left and the right joint of this role both hang.
        return lowest_common_ancestor(tree, [names.index(roles[f"{side}_{part}"]) for side in SIDES])

    arms_hub, legs_hub = hub("shoulder"), hub("hip")
    chest_and_neck = [names.index(roles[role]) for role in ("chest", "neck") if role in roles]
    if "chest" in roles and arms_hub not in chest_and_neck:
        file.refuse(f"chest is {roles['chest']}, but the arms hang from {names[arms_hub]}", "roles", "chest")
    offsets = {name: np.array(joint["offset"], float) for name, joint in file.data["joints"].items()}
    from_hips = path_between(tree, names.index(roles["hips"]), legs_hub)
    # A bone's length is the offset of its lower joint, which may be either end, because the path may go up.
    lower = [a if tree[a] == b else b for a, b in pairwise(from_hips)]
    distance = sum(float(np.linalg.norm(offsets[names[j]])) for j in lower)
    leg_length = sum(float(np.linalg.norm(offsets[roles[f"left_{part}"]])) for part in ("knee", "heel"))
    if distance > APART * leg_length:
        file.refuse(f"hips is {roles['hips']}, but the legs hang from {names[legs_hub]}", "roles", "hips")


def _check_sides(file: SkeletonFile, roles: Mapping[str, str]) -> None:
    """Check that no joint with a role on one side has a name that says the other side."""
    for role, joint in roles.items():
        side, side_in_name = role.partition("_")[0], side_of(joint)
        if side in SIDES and side_in_name is not None and side_in_name != side:
            file.refuse(
                f"{role} is {joint}, whose name says {side_in_name}",
                "roles",
                role,
                "Swap left and right. If the name is wrong, rename the joint here and in the clips.",
            )
