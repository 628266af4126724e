"""Writes a draft of a rig's skeleton file, for users to correct.

A skeleton file tells which joint of a rig has which role. A role names a part of the body, such as left_knee.
The draft contains the roles that are known.
"""

from __future__ import annotations

from collections.abc import Mapping

from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.motion.body import SIDES
from hobble.motion.doubt import Doubt
from hobble.motion.names import limb_parts, part_of, side_of
from hobble.motion.read import Bvh

# Roles in a skeleton file. The roles of limbs begin with the side. A rig may lack the OPTIONAL roles.
LIMBS = ("shoulder", "elbow", "wrist", "hip", "knee", "heel", "toe")
ROLES = ("hips", "spine", "chest", "neck", "head", *(f"{side}_{part}" for side in SIDES for part in LIMBS))
OPTIONAL = ("spine", "chest", "neck", "left_toe", "right_toe")
MOST_SHOWN = 80  # at most this many joints are shown in a message: enough for usual rigs with all fingers


def doubt_error(file: Bvh, rig: Skeleton, doubt: Doubt) -> InputError:
    """The error for a rig of which it is in doubt which joints are which parts of the body.

    It shows a draft of the skeleton file, or only the beginning of a long draft. rig: the joints of the file.
    """
    roles = guess_roles(rig) | {role: rig.joints[j] for role, j in doubt.certain_roles.items()}
    text, name, hidden = draft_skeleton_file(rig, roles), file.path.name, len(rig.joints) - MOST_SHOWN
    if hidden > 0:
        # The draft ends with one line for each joint.
        shown = "\n".join(text.rstrip("\n").split("\n")[:-hidden])
        text = f"{shown}\n  ... ({hidden} more joints; python -m hobble.motion rig {name} writes all)\n"
        fix = (
            f"Write a draft with `python -m hobble.motion rig {name} --to config/skeletons/<name>.yaml`, put "
            "the right joints into it, and run again. The draft begins:"
        )
    else:
        fix = (
            f"Put the right joints into this draft (`python -m hobble.motion rig {name}` prints it, too), "
            "save it as config/skeletons/<name>.yaml, and run again:"
        )
    problem = f"the parts of this rig are in doubt: {doubt}"
    return InputError(file.path, problem, fix=f"{fix}\n\n{text}")


def draft_skeleton_file(rig: Skeleton, roles: Mapping[str, str]) -> str:
    """The text of a skeleton file (YAML): the rig's joints and their roles.

    roles: role -> name of its joint. The roles that are not in `roles` are left out if they are optional.
    Otherwise they get `?` as their joint.
    """
    lines = ["# Role: joint. Fill in each ?. Leave out roles that the rig does not have.", "roles:"]
    for role in ROLES:
        if role in roles:
            lines.append(f"  {role}: {_quoted(roles[role])}")
        elif role not in OPTIONAL:
            lines.append(f"  {role}: '?'")
    lines.append("joints:")
    for name, parent, offset in zip(rig.joints, rig.parents, rig.offsets, strict=True):
        parent_name = "null" if parent < 0 else _quoted(rig.joints[parent])
        # x + 0.0 turns -0.0 into 0.0.
        numbers = ", ".join(f"{x + 0.0:.6g}" for x in (offset if parent >= 0 else 0 * offset))
        lines.append(f"  {_quoted(name)}: {{parent: {parent_name}, offset: [{numbers}]}}")
    return "\n".join(lines) + "\n"


def guess_roles(rig: Skeleton) -> dict[str, str]:
    """Role -> name of the joint, for the roles that the names of the joints suggest."""
    out: dict[str, str] = {}
    for name in rig.joints:
        part = part_of(name)
        if side_of(name) is None and part in ("hips", "spine", "chest", "neck", "head") and part not in out:
            out[part] = name
    # A role is the joint at which a part of a limb begins.
    role_of_part = {"upperarm": "shoulder", "forearm": "elbow", "hand": "wrist"}
    role_of_part |= {"thigh": "hip", "shank": "knee", "foot": "heel", "toe": "toe"}
    for side in SIDES:
        names = [name for name in rig.joints if side_of(name) == side]
        arm_joints = [
            n
            for n in names
            if part_of(n) in ("clavicle", "shoulder", "upperarm", "arm", "forearm", "wrist", "hand")
        ]
        leg_words = ("hip", "thigh", "leg", "shank", "ankle", "foot", "toe")
        leg_joints = [n for n in names if part_of(n) in leg_words]
        for limb in (arm_joints, leg_joints):
            for part, index in limb_parts(limb).items():
                if part in role_of_part:
                    out[f"{side}_{role_of_part[part]}"] = limb[index]
    return out


def _quoted(name: str) -> str:
    """A name as a YAML string in single quotes."""
    return "'" + name.replace("'", "''") + "'"
