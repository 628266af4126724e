"""Loads the motion of a BVH file: in centimetres, right-handed, Y up, on a rig with a standing rest pose."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion.axes import RigAxes, straighten
from hobble.motion.body import Body, body_by_roles, pairs
from hobble.motion.body_in_file import body_in_file, notes_on_names
from hobble.motion.decode import Decoded, check_angles, decode, frame_rate
from hobble.motion.defects import Repaired, flips, repair
from hobble.motion.doubt import check_height
from hobble.motion.floor import on_floor
from hobble.motion.four_legs import on_four_legs
from hobble.motion.hips_root import below_hips, decode_below
from hobble.motion.options import ClipMotion
from hobble.motion.read import Bvh
from hobble.motion.rig import (
    RigMatch,
    TargetSkeleton,
    clean_names,
    find_hips,
    leg_length,
    match_rig,
    missing_bone,
    unit_of,
)
from hobble.motion.standing import why_not_standing
from hobble.motion.upright_rest import with_upright_rest

STILL = 0.1  # cm: a joint that stays this close to its offset counts as fixed to its parent
FOUND = "found"  # in reports: the name of a rig that has no skeleton file


@dataclass(frozen=True)
class FileMotion:
    """A file's motion at its own frame rate, on its own rig or on the joints of its body.

    match: which known skeleton the rig is, if any, and which of its joints the target's joints follow. unit,
    unit_name: cm per unit of the file, and the unit in words. axes: which of the file's axes points up, and
    so on. first_frame: the file's frame (from 0) at which the clip begins. repairs, notes: sentences on what
    was repaired, and on what else users should know. stance: where the rest pose comes from, in words.
    moving: whether any joint of the body except the hips moves relative to its parent. straightened: whether
    the clip is not on the file's rig, but on one with only the joints of the body and a standing rest pose.
    unsure: sentences on what is uncertain about the rest pose.
    """

    clip: Clip
    match: RigMatch
    unit: float
    unit_name: str
    axes: RigAxes
    first_frame: int
    repairs: list[str]
    notes: list[str]
    stance: str
    moving: bool
    straightened: bool
    unsure: list[str] = field(default_factory=list)


def load_source(file: Bvh, target: TargetSkeleton, maps: str | Path, options: ClipMotion) -> FileMotion:
    """A file's motion, checked and, if allowed, repaired.

    target: the skeleton to which the motion will go. maps: the folder of the skeleton files. options: the
    data set's options for this clip.

    A rig with a skeleton file and the rest pose given there counts as that skeleton. On other rigs the parts
    of the body and a standing rest pose are found. Raises InputError if the parts cannot be found, or for
    defects that cannot be repaired.
    """
    check_angles(file)
    repairs = _frame_count(file, options.defects)
    hips = find_hips(clean_names(file.names), target, maps)
    known = match_rig(rig_of(below_hips(file, hips)), target, maps)
    if known is not None and known.alike and known.sources:
        return _on_known_rig(file, hips, known, repairs, options)
    return _on_unknown_rig(file, target, known, repairs, options)


def _on_known_rig(
    file: Bvh, hips: int, match: RigMatch, repairs: list[str], options: ClipMotion
) -> FileMotion:
    """The motion of a file whose rig has a skeleton file. hips: index of the joint. match: to that file."""
    rig = replace(rig_of(below_hips(file, hips)), roles=match.roles)
    unit, unit_name = _unit(file.path, leg_length(rig), options.unit)
    decoded = decode_below(file, hips, STILL / unit)
    clip = _scaled(file, rig, decoded, unit, options)
    if bone := missing_bone(clip.skeleton):
        raise _boneless(file, bone)
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
        stance="its zero pose",
        moving=moving,
        straightened=False,
        unsure=straight.unsure,
    )
    return _repaired(file, source, options)


def _on_unknown_rig(
    file: Bvh, target: TargetSkeleton, known: RigMatch | None, repairs: list[str], options: ClipMotion
) -> FileMotion:
    """The motion of a file whose rig has no skeleton file, or another rest pose than the one given there.

    The parts of the body and a standing rest pose are found. known: the match to a skeleton file with the
    same joint names, if there is one. It tells the parts of the body.
    """
    rig = rig_of(file)
    decoded = _decoded(file)
    raw = Clip(file.path.stem, rig, 1.0, decoded.rotations, decoded.root, decoded.translations)
    found = body_in_file(file, rig, raw, known, options)
    body = found.body
    for a, b in (pair for leg in body.legs.values() for pair in pairwise(leg[:3])):
        if np.median(np.linalg.norm(raw.positions[:, b] - raw.positions[:, a], axis=-1)) < 1e-6:
            raise _boneless(file, f"{rig.joints[a]} to {rig.joints[b]}")
    unit, unit_name = _unit(file.path, _leg(raw, body), options.unit)
    rig = replace(rig, roles=body.roles(rig.joints))
    clip = _scaled(file, rig, decoded, unit, options)
    standing = why_not_standing(body, rest_positions(rig)) is None
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
    axes = straight.axes if standing else replace(straight.axes, facing="+Z")
    target_body = body_by_roles(target.skeleton)
    # A rig with the target's own joint names is matched with the target by names, and any other by parts.
    named = known.sources if known is not None and known.rig == target.skeleton.name else {}
    named_joints = [rig.index(joint) for joint in named.values()]
    standing_clip = with_upright_rest(straight.clip, body, target.skeleton, named_joints)
    check_height(file.path, standing_clip.height_error, standing_clip.notes, options.accept_doubt)
    match = RigMatch(
        known.rig if known else FOUND,
        standing_clip.clip.skeleton.roles,
        False,
        named or pairs(standing_clip.clip.skeleton, standing_clip.body, target.skeleton, target_body),
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
        stance=standing_clip.rest,
        moving=_moving(decoded, body, unit),
        straightened=True,
        unsure=straight.unsure + standing_clip.notes,
    )
    return _repaired(file, source, options)


def _repaired(file: Bvh, source: FileMotion, options: ClipMotion) -> FileMotion:
    """The motion with broken frames repaired and its floor at height zero."""
    leave = options.defects == "leave"
    repaired = Repaired(source.clip, 0, []) if leave else repair(source.clip)
    flat = options.ground == "flat" and not leave
    clip, moved, uneven = on_floor(repaired.clip) if flat else (repaired.clip, [], [])
    repairs = repaired.sentences + moved
    if repairs and options.defects == "refuse":
        raise InputError(file.path, repairs[0], fix="Set motion.defects: repair to repair it this way.")
    return replace(
        source,
        clip=clip,
        first_frame=repaired.first,
        repairs=source.repairs + repairs,
        notes=source.notes + uneven + flips(clip, repaired.first),
    )


def raw_clip(file: Bvh) -> Clip:
    """A file's motion in its own unit and axes, at one frame a second."""
    decoded = _decoded(file)
    return Clip(file.path.stem, rig_of(file), 1.0, decoded.rotations, decoded.root, decoded.translations)


def _decoded(file: Bvh) -> Decoded:
    longest = float(np.linalg.norm(file.offsets[1:], axis=-1).max(initial=0.0))
    return decode(file, 1e-3 * longest)


def rig_of(file: Bvh) -> Skeleton:
    """The joints of a file as a skeleton, in the file's unit. Prefixes of the names are left out."""
    names = clean_names(file.names)
    short = dict(zip(file.names, names, strict=True))
    ends = {short[name]: sites[0] for name, sites in file.end_sites.items()}
    return Skeleton(file.path.stem, names, file.parents, file.offsets, end_sites=ends)


def _boneless(file: Bvh, bone: str) -> InputError:
    return InputError(
        file.path,
        f"the bone from {bone} has no length",
        fix="Check its OFFSET and its position channels, and export the clip again.",
    )


def _frame_count(file: Bvh, defects: str) -> list[str]:
    if len(file) == file.declared:
        return []
    problem = f"declares {file.declared} frames and has {len(file)}"
    if defects == "refuse":
        raise InputError(file.path, problem, fix="Export the clip again, or set motion.defects: repair.")
    return [f"The file {problem}; those it holds are used."]


def _leg(clip: Clip, body: Body) -> float:
    """Length of thigh and shank together: mean of both sides, median over the frames."""
    bones = [pair for leg in body.legs.values() for pair in pairwise(leg[:3])]
    apart = [np.linalg.norm(clip.positions[:, b] - clip.positions[:, a], axis=-1) for a, b in bones]
    return float(np.median(sum(apart)) / 2)


def _moving(decoded: Decoded, body: Body, unit: float) -> bool:
    """Whether any joint of the body except its hips moves relative to its parent."""
    if decoded.translations is None:
        return False
    parts = [j for limbs in (body.arms, body.legs) for limb in limbs.values() for j in limb if j is not None]
    local = decoded.translations[:, [*body.trunk, *body.neck, body.head, *parts]]
    return bool(np.abs(local - np.median(local, axis=0)).max() * unit > STILL)


def _unit(path: Path, leg: float, unit: str | float) -> tuple[float, str]:
    if unit != "auto":
        return float(unit), f"{float(unit):g} cm (given)"
    found = unit_of(leg)
    if found is None:
        raise InputError(
            path,
            f"no unit gives this rig a person's size: thigh and shank together are {leg:g} units long",
            fix="Set motion.unit in the data set to the centimetres per unit.",
        )
    return found


def _scaled(file: Bvh, rig: Skeleton, decoded: Decoded, unit: float, options: ClipMotion) -> Clip:
    fps = options.source_fps or frame_rate(file.frame_time, file.frame_time_text)
    offsets = decoded.offsets * unit
    offsets[0] = 0.0
    ends = {joint: (x * unit, y * unit, z * unit) for joint, (x, y, z) in rig.end_sites.items()}
    skeleton = replace(rig, offsets=offsets, end_sites=ends)
    translations = None if decoded.translations is None else decoded.translations * unit
    return Clip(file.path.stem, skeleton, fps, decoded.rotations, decoded.root * unit, translations)
