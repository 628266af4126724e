"""Loads the motion of a BVH file.

The result is in centimetres, right-handed, with Y up. A rig is the skeleton in a BVH file. A known skeleton
is one that has a file in `config/skeletons`. Any other rig gets a standing rest pose. The zero pose of a rig
is the one in which all rotations are zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion.axes import RigAxes, straighten
from hobble.motion.body import Body, body_by_roles, match_joints
from hobble.motion.body_in_file import body_in_file, notes_on_names
from hobble.motion.decode import Decoded, check_angles, decode_channels, frame_rate
from hobble.motion.defects import Repaired, notes_on_flips, repair_defects
from hobble.motion.doubt import check_height
from hobble.motion.floor import put_on_floor
from hobble.motion.four_legs import on_four_legs
from hobble.motion.hips_root import below_hips, decode_below
from hobble.motion.options import ClipMotion
from hobble.motion.read import Bvh
from hobble.motion.rig import (
    KnownSkeleton,
    RigMatch,
    clean_names,
    find_hips,
    leg_length,
    likely_unit,
    match_rig,
    missing_bone,
)
from hobble.motion.standing import why_not_standing
from hobble.motion.upright_rest import with_upright_rest

STILL = 0.1  # cm: a joint that stays this close to its offset counts as fixed to its parent
UNKNOWN_RIG = "found"  # stands in reports instead of the rig's name if the rig is no known skeleton


@dataclass(frozen=True)
class FileMotion:
    """A file's motion at the file's own frame rate.

    It is on the file's own rig, or, if `has_standing_rig`, on a rig that has only the joints of the body and
    a standing rest pose.

    match: which known skeleton the rig is, if any, and which of the rig's joints each joint of the target
    follows. unit, unit_name: cm per unit of the file, and the unit in words. axes: which of the file's axes
    points up, and where the figure faces. first_frame: the file's frame (from 0) at which the clip begins.
    repairs, notes: sentences on what was repaired, and on what else users should know. rest_source: where the
    rest pose comes from, in words. has_moving_joints: whether any joint of the body except the hips moves
    relative to its parent. unsure: sentences on what is uncertain about the rest pose.
    """

    clip: Clip
    match: RigMatch
    unit: float
    unit_name: str
    axes: RigAxes
    first_frame: int
    repairs: list[str]
    notes: list[str]
    rest_source: str
    has_moving_joints: bool
    has_standing_rig: bool
    unsure: list[str] = field(default_factory=list)


def load_source(
    file: Bvh, target: KnownSkeleton, skeleton_folder: str | Path, options: ClipMotion
) -> FileMotion:
    """A file's motion, checked and, if allowed, repaired.

    target: the skeleton to which the motion will be retargeted. skeleton_folder: the folder of the skeleton
    files. options: the data set's options for this clip.

    A rig counts as a known skeleton if it has the joint names and the rest pose of its file. On other rigs
    the parts of the body and a standing rest pose are found. Raises InputError if the parts cannot be found,
    or for defects that cannot be repaired.
    """
    check_angles(file)
    repairs = _check_frame_count(file, options.defects)
    hips = find_hips(clean_names(file.names), target, skeleton_folder)
    known = match_rig(rig_in_file(below_hips(file, hips)), target, skeleton_folder)
    # The match has `followed_joints` if a map leads from the known skeleton to the target.
    if known is not None and known.has_known_rest_pose and known.followed_joints:
        return _load_known_rig(file, hips, known, repairs, options)
    return _load_unknown_rig(file, target, known, repairs, options)


def _load_known_rig(
    file: Bvh, hips: int, match: RigMatch, repairs: list[str], options: ClipMotion
) -> FileMotion:
    """The motion of a file whose rig is a known skeleton.

    hips: index of the hips in the file. match: the known skeleton. repairs: sentences on what was repaired so
    far.
    """
    rig = replace(rig_in_file(below_hips(file, hips)), roles=match.roles)
    unit, unit_name = _unit(file.path, leg_length(rig), options.unit)
    decoded = decode_below(file, hips, STILL / unit)
    clip = _scaled(file, rig, decoded, unit, options)
    if bone := missing_bone(clip.skeleton):
        raise _no_length_error(file, bone)
    straight = straighten(clip, options.up, options.handedness)
    moving = decoded.translations is not None
    source = FileMotion(
        straight.clip,
        match,
        unit,
        unit_name,
        straight.axes,
        first_frame=0,
        repairs=repairs + decoded.repairs,
        notes=decoded.notes + straight.notes,
        rest_source="its zero pose",
        has_moving_joints=moving,
        has_standing_rig=False,
        unsure=straight.unsure,
    )
    return _repair_and_ground(file, source, options)


def _load_unknown_rig(
    file: Bvh, target: KnownSkeleton, known: RigMatch | None, repairs: list[str], options: ClipMotion
) -> FileMotion:
    """The motion of a file whose rig is no known skeleton, or has another rest pose than the known one.

    The parts of the body and a standing rest pose are found. known: the known skeleton that has the rig's
    joint names, if there is one. It tells the parts of the body. repairs: sentences on what was repaired so
    far.
    """
    rig = rig_in_file(file)
    decoded = _decode(file)
    # In the file's unit and axes. The frame rate does not matter here.
    raw = Clip(file.path.stem, rig, 1.0, decoded.rotations, decoded.root, decoded.translations)
    found = body_in_file(file, rig, raw, known, options)
    body = found.body
    for start, end in (bone for leg in body.legs.values() for bone in pairwise(leg[:3])):
        if np.median(np.linalg.norm(raw.positions[:, end] - raw.positions[:, start], axis=-1)) < 1e-6:
            raise _no_length_error(file, f"{rig.joints[start]} to {rig.joints[end]}")
    unit, unit_name = _unit(file.path, _leg_length(raw, body), options.unit)
    rig = replace(rig, roles=body.roles(rig.joints))
    clip = _scaled(file, rig, decoded, unit, options)
    standing = why_not_standing(body, rest_positions(clip.skeleton)) is None
    if not standing and on_four_legs(body, raw.positions):
        raise InputError(
            file.path, "the figure goes on four legs", fix="Only clips of figures with two legs can be used."
        )
    try:
        straight = straighten(clip, options.up, options.handedness, standing)
    except ValueError as error:
        raise InputError(
            file.path, f"the up axis is in doubt: {error}", fix="Set motion.up in the data set to Y or Z."
        ) from None
    # The standing rest pose that replaces another one faces +Z.
    axes = straight.axes if standing else replace(straight.axes, facing="+Z")
    target_body = body_by_roles(target.skeleton)
    # A rig with the target's own joint names is matched with the target by these names, and any other rig by
    # the parts of the body.
    named = known.followed_joints if known is not None and known.rig == target.skeleton.name else {}
    named_joints = [rig.index(joint) for joint in named.values()]
    standing_clip = with_upright_rest(straight.clip, body, target.skeleton, named_joints)
    check_height(file.path, standing_clip.height_error, standing_clip.doubts, options.accept_doubt)
    match = RigMatch(
        known.rig if known else UNKNOWN_RIG,
        standing_clip.clip.skeleton.roles,
        False,
        named or match_joints(standing_clip.clip.skeleton, standing_clip.body, target.skeleton, target_body),
    )
    notes = decoded.notes + straight.notes + ([] if known else notes_on_names(found, options.handedness))
    source = FileMotion(
        standing_clip.clip,
        match,
        unit,
        unit_name,
        axes,
        first_frame=0,
        repairs=repairs + decoded.repairs,
        notes=notes,
        rest_source=standing_clip.rest_source,
        has_moving_joints=_has_moving_joints(decoded, body, unit),
        has_standing_rig=True,
        unsure=straight.unsure + standing_clip.doubts,
    )
    return _repair_and_ground(file, source, options)


def _repair_and_ground(file: Bvh, source: FileMotion, options: ClipMotion) -> FileMotion:
    """The motion with broken frames repaired and a flat floor at height zero.

    If the option `defects` is "leave", both stay as they are.
    """
    leave = options.defects == "leave"
    repaired = Repaired(source.clip, 0, []) if leave else repair_defects(source.clip)
    flat = options.ground == "flat" and not leave
    clip, floor_repairs, floor_notes = put_on_floor(repaired.clip) if flat else (repaired.clip, [], [])
    repairs = repaired.sentences + floor_repairs
    if repairs and options.defects == "refuse":
        raise InputError(file.path, repairs[0], fix="Set motion.defects: repair to repair it this way.")
    return replace(
        source,
        clip=clip,
        first_frame=repaired.first,
        repairs=source.repairs + repairs,
        notes=source.notes + floor_notes + notes_on_flips(clip, repaired.first),
    )


def raw_clip(file: Bvh) -> Clip:
    """A file's motion in its own unit and axes, for uses in which the frame rate does not matter: it is 1."""
    decoded = _decode(file)
    return Clip(file.path.stem, rig_in_file(file), 1.0, decoded.rotations, decoded.root, decoded.translations)


def _decode(file: Bvh) -> Decoded:
    """The file's rotations and positions.

    The file's unit is not known yet. So a joint counts as fixed to its parent if it moves by less than a
    thousandth of the longest bone.
    """
    longest = float(np.linalg.norm(file.offsets[1:], axis=-1).max(initial=0.0))
    return decode_channels(file, 1e-3 * longest)


def rig_in_file(file: Bvh) -> Skeleton:
    """The joints of a file as a skeleton, in the file's unit. Prefixes like "mixamorig:" are left out."""
    names = clean_names(file.names)
    new_name = dict(zip(file.names, names, strict=True))
    ends = {new_name[name]: sites[0] for name, sites in file.end_sites.items()}
    return Skeleton(file.path.stem, names, file.parents, file.offsets, end_sites=ends)


def _no_length_error(file: Bvh, bone: str) -> InputError:
    """The error for a bone without length. bone: such as "LeftUpLeg to LeftLeg"."""
    return InputError(
        file.path,
        f"the bone from {bone} has no length",
        fix="Check its OFFSET and its position channels, and export the clip again.",
    )


def _check_frame_count(file: Bvh, defects: str) -> list[str]:
    """A sentence if the file has another number of frames than its header declares, else an empty list.

    Raises InputError instead if the option `defects` is "refuse".
    """
    if len(file) == file.declared:
        return []
    problem = f"declares {file.declared} frames and has {len(file)}"
    if defects == "refuse":
        raise InputError(file.path, problem, fix="Export the clip again, or set motion.defects: repair.")
    return [f"The file {problem}. The {len(file)} frames are used."]


def _leg_length(clip: Clip, body: Body) -> float:
    """Length of thigh and shank together, in the clip's unit: mean of both sides, median over the frames."""
    bones = [pair for leg in body.legs.values() for pair in pairwise(leg[:3])]
    apart = [np.linalg.norm(clip.positions[:, b] - clip.positions[:, a], axis=-1) for a, b in bones]
    return float(np.median(sum(apart)) / 2)


def _has_moving_joints(decoded: Decoded, body: Body, unit: float) -> bool:
    """Whether any joint of the body except its hips moves relative to its parent."""
    if decoded.translations is None:
        return False
    limb_joints = [j for limbs in (body.arms, body.legs) for limb in limbs.values() for j in limb]
    joints = [*body.trunk, *body.neck, body.head, *(j for j in limb_joints if j is not None)]
    local = decoded.translations[:, joints]
    return bool(np.abs(local - np.median(local, axis=0)).max() * unit > STILL)


def _unit(path: Path, leg: float, unit: str | float) -> tuple[float, str]:
    """Centimetres per unit of the file, and the unit in words.

    leg: length of thigh and shank together, in the file's unit. unit: the option, a number or "auto".
    """
    if unit != "auto":
        return float(unit), f"{float(unit):g} cm (given)"
    found = likely_unit(leg)
    if found is None:
        raise InputError(
            path,
            f"no unit gives this rig a person's size: thigh and shank together are {leg:g} units long",
            fix="Set motion.unit in the data set to the centimetres per unit.",
        )
    return found


def _scaled(file: Bvh, rig: Skeleton, decoded: Decoded, unit: float, options: ClipMotion) -> Clip:
    """The decoded motion as a clip in centimetres, at the file's frame rate. unit: cm per file unit."""
    fps = options.source_fps or frame_rate(file.frame_time, file.frame_time_text)
    offsets = decoded.offsets * unit
    offsets[0] = 0.0
    ends = {joint: (x * unit, y * unit, z * unit) for joint, (x, y, z) in rig.end_sites.items()}
    skeleton = replace(rig, offsets=offsets, end_sites=ends)
    translations = None if decoded.translations is None else decoded.translations * unit
    return Clip(file.path.stem, skeleton, fps, decoded.rotations, decoded.root * unit, translations)
