"""Finds the body in a BVH file, or refuses the file if the parts of the body are in doubt."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton
from hobble.motion.body import SIDES, body_by_roles, with_fingers
from hobble.motion.doubt import Doubt, TwoFigures
from hobble.motion.draft import doubt_error
from hobble.motion.find_body import FoundBody, find_body
from hobble.motion.options import ClipMotion
from hobble.motion.read import Bvh
from hobble.motion.retarget import LIMB_BONES
from hobble.motion.rig import RigMatch

Limb = TypeVar("Limb")
# The bones of the limbs: roles of their two ends.
BONES = [(f"{side}_{start}", f"{side}_{end}") for side in SIDES for start, end in LIMB_BONES.items()]
STRETCH = 0.06  # share of its length by which a bone may change; in 172 real clips the change is 0


def body_in_file(
    file: Bvh, rig: Skeleton, raw: Clip, known: RigMatch | None, options: ClipMotion
) -> FoundBody:
    """The body of a file's rig.

    rig: the file's joints. raw: its motion, in any unit and axes. known: the skeleton file that describes the
    rig, if there is one. Raises InputError if the parts are in doubt (the message then contains a draft of a
    skeleton file), if there are two figures, or if nothing tells left from right.
    """
    if known is not None:
        _check_bones(file, raw, known)
        return FoundBody(body_by_roles(replace(rig, roles=known.roles)), True)
    try:
        found = find_body(rig.joints, rig.parents, raw.positions)
    except TwoFigures as error:
        raise InputError(file.path, str(error), fix="Export each figure on its own.") from None
    except Doubt as doubt:
        raise doubt_error(file, rig, doubt) from None
    if not found.sided and options.handedness == "auto":
        raise InputError(
            file.path,
            "its joint names do not say left and right, and its mirror image would also move like a person",
            fix="Set motion.handedness in the data set: right, the standard of BVH files, or left, if the "
            "program that wrote the file has left-handed coordinates.",
        )
    body = found.body
    if not found.sided and options.handedness == "left":
        body = replace(body, arms=_swapped(body.arms), legs=_swapped(body.legs))
    return replace(found, body=with_fingers(body, rig))


def _check_bones(file: Bvh, raw: Clip, known: RigMatch) -> None:
    """Raise InputError if a bone of a limb changes its length: then a role has a wrong joint."""
    for start, end in BONES:
        if start in known.roles and end in known.roles:
            a, b = (raw.positions[:, raw.skeleton.index(known.roles[role])] for role in (start, end))
            low, middle, high = np.percentile(np.linalg.norm(b - a, axis=-1), [3, 50, 97])
            if high - low > STRETCH * middle:
                raise InputError(
                    file.path,
                    f"{known.roles[end]} ({end}) is {low:.3g} to {high:.3g} units from {known.roles[start]} "
                    f"({start}), so a joint between them bends, or one of them is not the joint of its role",
                    fix=f"Correct the roles in the skeleton file {known.rig}.yaml.",
                )


def _swapped(limbs: Mapping[str, Limb]) -> dict[str, Limb]:
    return {a: limbs[b] for a, b in (SIDES, SIDES[::-1])}


def notes_on_names(found: FoundBody, handedness: str) -> list[str]:
    """Sentences on how the parts of the rig and its left side were found."""
    out = ["No skeleton file describes this rig: its parts were found from structure, motion and names."]
    if not found.sided:
        out.append(f"Its joint names do not say left and right, so motion.handedness: {handedness} was used.")
    return out
