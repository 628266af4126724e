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

Limb = TypeVar("Limb")  # the tuple of joints of an arm or of a leg, as in `Body`
# The bones of the limbs, as pairs of roles: the role at the beginning and at the end of each bone.
BONES = [(f"{side}_{start}", f"{side}_{end}") for side in SIDES for start, end in LIMB_BONES.items()]
# Share of its length by which a bone may vary from the 3rd to the 97th percentile of a clip. In 172 real
# clips, the lengths do not vary.
STRETCH = 0.06


def body_in_file(
    file: Bvh, rig: Skeleton, raw: Clip, known: RigMatch | None, options: ClipMotion
) -> FoundBody:
    """The body of a file's rig.

    rig: the file's joints. raw: the file's motion, in any unit and along any axes. known: the match of the
    rig to the skeleton file that describes it, or None if there is no such file. options: only `handedness`
    is used.

    Raises InputError if a bone of a limb changes its length, if the parts of the body are in doubt (the
    message then contains a draft of a skeleton file), if there are two figures, or if neither the names of
    joints nor `handedness` tell left from right.
    """
    if known is not None:
        _check_bones(file, raw, known)
        return FoundBody(body_by_roles(replace(rig, roles=known.roles)), sided=True)
    try:
        found = find_body(rig.joints, rig.parents, raw.positions)
    except TwoFigures as error:
        raise InputError(file.path, str(error), fix="Export each figure on its own.") from None
    except Doubt as doubt:
        raise doubt_error(file, rig, doubt) from None
    if not found.sided and options.handedness == "auto":
        raise InputError(
            file.path,
            "its joint names do not tell left from right. The motion does not either, because its mirror "
            "image would also move like a person",
            fix="Set motion.handedness in the data set to right, the standard of BVH files, or to left if "
            "the program that wrote the file has left-handed coordinates.",
        )
    body = found.body
    if not found.sided and options.handedness == "left":
        body = replace(body, arms=_swapped(body.arms), legs=_swapped(body.legs))
    return replace(found, body=with_fingers(body, rig))


def _check_bones(file: Bvh, raw: Clip, known: RigMatch) -> None:
    """Raise InputError if a bone of a limb changes its length, because then a role has the wrong joint."""
    for start, end in BONES:
        if start in known.roles and end in known.roles:
            a, b = (raw.positions[:, raw.skeleton.index(known.roles[role])] for role in (start, end))
            low, median, high = np.percentile(np.linalg.norm(b - a, axis=-1), [3, 50, 97])
            if high - low > STRETCH * median:
                raise InputError(
                    file.path,
                    f"{known.roles[end]} ({end}) is {low:.3g} to {high:.3g} units from {known.roles[start]} "
                    f"({start}), so a joint between them bends, or one of them is not the joint of its role",
                    fix=f"Correct the roles in the skeleton file {known.rig}.yaml.",
                )


def _swapped(limbs: Mapping[str, Limb]) -> dict[str, Limb]:
    """The limbs (side -> joints) with left and right exchanged."""
    return {a: limbs[b] for a, b in (SIDES, SIDES[::-1])}


def notes_on_names(found: FoundBody, handedness: str) -> list[str]:
    """Sentences for the report: how the parts of the body, and which side is left, were found."""
    out = [
        "No skeleton file describes this rig. The parts of the body were found from the rig's structure, its "
        "motion and the names of its joints."
    ]
    if not found.sided:
        out.append(
            f"The joint names do not tell left from right, so motion.handedness: {handedness} was used."
        )
    return out
