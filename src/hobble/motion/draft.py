"""Writes a draft of a rig's skeleton file, for users to correct.

The file tells which joint has which role. The draft contains the roles that are known.
"""

from __future__ import annotations

from collections.abc import Mapping

from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.motion.body import SIDES
from hobble.motion.doubt import Doubt
from hobble.motion.names import limb_parts, part_of, side_of
from hobble.motion.read import Bvh

# Roles in a skeleton file. Those of limbs begin with the side, as in left_knee. A rig may lack OPTIONAL
# roles.
LIMBS = ("shoulder", "elbow", "wrist", "hip", "knee", "heel", "toe")
ROLES = ("hips", "spine", "chest", "neck", "head", *(f"{side}_{part}" for side in SIDES for part in LIMBS))
OPTIONAL = ("spine", "chest", "neck", "left_toe", "right_toe")
MOST_SHOWN = 80  # at most this many joints are shown in a message: enough for usual rigs with all fingers


def refusal(file: Bvh, rig: Skeleton, doubt: Doubt) -> InputError:
    """The error for a rig whose parts of the body are in doubt.

    It shows a draft of the skeleton file, or only the beginning of a long draft. rig: the joints of the file.
    """
    roles = guessed(rig) | {role: rig.joints[j] for role, j in doubt.certain_roles.items()}
    text, name, hidden = draft(rig, roles), file.path.name, len(rig.joints) - MOST_SHOWN
    if hidden > 0:
        shown = "\n".join(text.rstrip("\n").split("\n")[:-hidden])
        text = f"{shown}\n  ... ({hidden} more; python -m hobble.motion rig {name} writes all)\n"
        fix = (
            f"Write a draft with `python -m hobble.motion rig {name} --to config/skeletons/<name>.yaml`, put "
            "the right joints into it, and run again. It begins:"
        )
    else:
        fix = (
            f"Put the right joints into this draft (`python -m hobble.motion rig {name}` prints it, too), "
            "save it as config/skeletons/<name>.yaml, and run again:"
        )
    problem = f"the parts of this rig are in doubt: {doubt}"
    return InputError(file.path, problem, fix=f"{fix}\n\n{text}")


def draft(rig: Skeleton, roles: Mapping[str, str]) -> str:
    """The text of the skeleton file (YAML): the rig's joints and their roles.

    roles: role -> joint. Other roles are left out if they are optional, and get `?` as joint if not.
    """
    lines = ["# Role: joint. Fill in each ?. Leave out roles that the rig does not have.", "roles:"]
    for role in ROLES:
        if role in roles:
            lines.append(f"  {role}: {_quoted(roles[role])}")
        elif role not in OPTIONAL:
            lines.append(f"  {role}: '?'")
    lines.append("joints:")
    for name, p, offset in zip(rig.joints, rig.parents, rig.offsets, strict=True):
        parent = "null" if p < 0 else _quoted(rig.joints[p])
        place = ", ".join(f"{x + 0.0:.6g}" for x in (offset if p >= 0 else 0 * offset))
        lines.append(f"  {_quoted(name)}: {{parent: {parent}, offset: [{place}]}}")
    return "\n".join(lines) + "\n"


def guessed(rig: Skeleton) -> dict[str, str]:
    """Role -> joint, as far as the names of the joints suggest it."""
    out: dict[str, str] = {}
    for name in rig.joints:
        part = part_of(name)
        if side_of(name) is None and part in ("hips", "spine", "chest", "neck", "head") and part not in out:
            out[part] = name
    roles = {"upperarm": "shoulder", "forearm": "elbow", "hand": "wrist"}
    roles |= {"thigh": "hip", "shank": "knee", "foot": "heel", "toe": "toe"}
    for side in SIDES:
        names = [name for name in rig.joints if side_of(name) == side]
        arm = [
            n
            for n in names
            if part_of(n) in ("clavicle", "shoulder", "upperarm", "arm", "forearm", "wrist", "hand")
        ]
        leg = [n for n in names if part_of(n) in ("hip", "thigh", "leg", "shank", "ankle", "foot", "toe")]
        for limb in (arm, leg):
            for part, place in limb_parts(limb).items():
                if part in roles:
                    out[f"{side}_{roles[part]}"] = limb[place]
    return out


def _quoted(name: str) -> str:
    return "'" + name.replace("'", "''") + "'"
