"""Loads the motion of a BVH file.

The result is in centimetres, right-handed, with Y up. A rig is the skeleton in a BVH file. A known skeleton
is one that has a file in `config/skeletons`. Any other rig gets a standing rest pose. The zero pose of a rig
is the one in which all rotations are zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion.axes import RigAxes, straighten, turned_about_vertical
from hobble.motion.body import Body, body_by_roles, match_joints
from hobble.motion.edit import (
    Repaired,
    loop_clip,
    notes_on_flips,
    repair_defects,
    resample,
)
from hobble.motion.ground import check_tilt, put_on_floor
from hobble.motion.limbs import on_four_legs
from hobble.motion.options import ClipMotion
from hobble.motion.physics import check_pace
from hobble.motion.read import (
    MOST_JOINT_POSES,
    Bvh,
    Decoded,
    check_angles,
    decode_channels,
    frame_rate,
    read_bvh,
)
from hobble.motion.rest_pose import UprightMotion, why_not_standing, with_upright_rest
from hobble.motion.retarget import check_difference, check_knees, compare_motions, plan, retarget_clip
from hobble.motion.rig import (
    RigMatch,
    below_hips,
    body_in_file,
    clean_names,
    decode_below,
    find_hips,
    leg_length,
    likely_unit,
    match_rig,
    missing_bone,
)
from hobble.motion.root import facing_directions
from hobble.motion.skeleton_file import KnownSkeleton, load_skeleton

STILL = 0.1  # cm: a joint that stays this close to its offset counts as fixed to its parent
MOST_HEIGHT_ERROR = 3.0  # cm (two standard deviations): a clip whose height is more uncertain is refused
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
    body, how_found = body_in_file(file.path, raw, known, options.handedness)
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
    _check_height(file.path, standing_clip, options.accept_doubt)
    match = RigMatch(
        known.rig if known else UNKNOWN_RIG,
        standing_clip.clip.skeleton.roles,
        False,
        named or match_joints(standing_clip.clip.skeleton, standing_clip.body, target.skeleton, target_body),
    )
    notes = decoded.notes + straight.notes + how_found
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


def _check_height(path: Path, motion: UprightMotion, accept: bool) -> None:
    """Raise InputError if the height of a figure is too uncertain. accept: take the clip anyway."""
    if motion.height_error > MOST_HEIGHT_ERROR and not accept:
        raise InputError(
            path,
            " ".join(motion.doubts),
            fix="Use a clip in which both feet stand flat, or one with a zero pose (all rotations zero) in "
            "which a person could stand. To use this clip anyway, set motion.accept_doubt: true.",
        )


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


# Converts a BVH file to a clip on the target skeleton, and reports what was found and changed.
#
# The target is the skeleton of the data set. The source is the file's motion on its own rig.


SAME = 1e-3  # cm: offsets count as equal if they differ from the target skeleton's by at most this much

# Sentences for the report of a file in which joints other than the root have position channels that move.
KEPT = "Movements of joints relative to their parents were kept."
DROPPED = "Movements of joints relative to their parents were dropped, because the bone lengths changed."


def make_clip(
    bvh: str | Path,
    skeleton: str | Path,
    skeleton_folder: str | Path,
    clip: str,
    skeleton_name: str,
    options: ClipMotion,
) -> tuple[Clip, dict[str, Any]]:
    """Read a BVH file, check it, and convert it to the skeleton at the frame rate of `options`.

    skeleton: file of the target skeleton. skeleton_folder: the folder of the skeleton files. clip: name of
    the new clip. skeleton_name: name of the target skeleton. options: those of the data set's section
    `motion`, already overridden by those of the clip's own entry.

    Returns the clip and its report (the content of `motion/<clip>.json`). Raises InputError for a file
    that cannot be read, for an unsuitable skeleton, and for defects that cannot be repaired; with
    `defects: refuse`, for all defects.
    """
    target = load_skeleton(skeleton, skeleton_name)
    file = read_bvh(bvh)
    source = load_source(file, target, skeleton_folder, options)
    _check_length(file, source.clip, target.skeleton, options)
    resampled = resample(source.clip, options.fps)
    fitted = fit_skeleton(resampled, source, target.skeleton, options.proportions)
    if fitted.difference is not None:
        check_difference(file.path, fitted.difference, source.match.rig)
    # `defects: leave` switches these three checks off. The check of the knees is also off if the user has set
    # the handedness, and the check of the tilt if the user has set the axis that points up.
    leave = options.defects == "leave"
    check_knees(file.path, fitted.clip, leave or options.handedness != "auto")
    doubtful_pace = check_pace(file.path, fitted.clip, leave)
    check_tilt(file.path, fitted.clip, leave or options.up != "auto")
    new_clip, repairs, loops = fitted.clip, source.repairs + fitted.repairs, options.loops
    if loops > 1:
        new_clip = loop_clip(new_clip, loops, options.heading)
        frames = len(new_clip) // loops
        repairs.append(f"The cycle of {frames} frames was repeated {loops} times, with blended seams.")
    if options.facing is not None:
        new_clip = turned_about_vertical(new_clip, np.radians(options.facing) - first_facing(new_clip))
    new_clip = replace(new_clip, name=clip)
    _check_finite(file, new_clip)
    extra: dict[str, Any] = {
        "loops": loops,
        "cycle_frames": len(new_clip) // loops,
        "scale": fitted.scale,
        "retarget": fitted.difference,
        "unsure": fitted.unsure + ([doubtful_pace] if doubtful_pace else []),
    }
    return new_clip, _report(file, source, new_clip) | extra | {"repairs": repairs, "notes": source.notes}


def _check_length(file: Bvh, clip: Clip, target: Skeleton, options: ClipMotion) -> None:
    """Raise InputError for a clip that would need too much memory at its new frame rate, with all its loops.

    No real clip is that long: a wrong frame rate or number of loops is more likely.
    """
    frames = len(clip) / clip.fps * options.fps * options.loops
    if frames * max(len(clip.skeleton.joints), len(target.joints)) > MOST_JOINT_POSES:
        looped, fewer = "", ""
        if options.loops > 1:
            looped, fewer = f" with {options.loops} loops", ", or set fewer loops"
        raise InputError(
            file.path,
            f"{len(clip)} frames at {clip.fps:g} a second become {frames:.0f} at {options.fps:g}{looped}; "
            f"frames times joints may be at most {MOST_JOINT_POSES}",
            fix=f"Cut it into shorter clips, or set its source_fps{fewer}.",
        )


def _check_finite(file: Bvh, clip: Clip) -> None:
    """Raise InputError if a number of the clip is not finite. The usual cause is bones without length."""
    lengths = np.linalg.norm(file.offsets, axis=1)
    for values in (clip.rotations, clip.root, clip.positions):
        bad = ~np.isfinite(values).reshape(len(clip), -1).all(axis=1)
        if bad.any():
            short = ", ".join(
                name for name, length in zip(file.names[1:], lengths[1:], strict=True) if not length
            )
            why = f" (in the file, these joints have no length: {short:.200})" if short else ""
            raise InputError(
                file.path,
                f"the joints of {clip.skeleton.name} get rotations or positions that are not finite{why}",
                frame=int(np.argmax(bad)) + 1,
                fix="Check the OFFSETs and the values, and export the clip again.",
            )


def first_facing(clip: Clip) -> float:
    """Facing direction in the first frame, radians from +Z towards +X."""
    ahead = facing_directions(clip.skeleton, clip.positions[:1], 0.0)[0]
    return float(np.arctan2(ahead[0], ahead[2]))


@dataclass(frozen=True)
class Fitted:
    """The result of `fit_skeleton`: a clip on the joints of the target.

    scale: length of the clip's path / length of the source's path. repairs: sentences on what was changed.
    difference: how the clip differs from the source (see `hobble.motion.retarget.compare_motions`), or
    None if it was not retargeted. unsure: sentences on what is uncertain.
    """

    clip: Clip
    scale: float
    repairs: list[str]
    difference: dict[str, Any] | None = None
    unsure: list[str] = field(default_factory=list)


def fit_skeleton(clip: Clip, source: FileMotion, target: Skeleton, proportions: str) -> Fitted:
    """Put the clip's motion on the target skeleton.

    clip: the clip of `source` at the new frame rate. proportions: "skeleton" for the target's bone lengths,
    "clip" to keep the clip's own bone lengths. They can be kept if the clip has the target's joints,
    and its bones point in the same directions in the rest pose.
    """
    match = source.match
    if match.is_target_skeleton:
        reordered = _reordered(clip, np.array([clip.skeleton.index(name) for name in target.joints]), target)
        has_equal_offsets = np.abs(reordered.skeleton.offsets - target.offsets).max() <= SAME
        if has_equal_offsets or proportions == "clip":
            reordered = replace(reordered, skeleton=target) if has_equal_offsets else reordered
            return Fitted(reordered, 1.0, [KEPT] if source.has_moving_joints else [])
    followed_joints, unsure = match.followed_joints, source.unsure
    # Retargeting needs a rest pose that stands. If `has_standing_rig` is True, `load_source` has made one.
    if not source.has_standing_rig:
        joints_to_keep = {clip.skeleton.index(name) for name in followed_joints.values()}
        standing = with_upright_rest(clip, body_by_roles(clip.skeleton), target, joints_to_keep)
        clip, unsure = standing.clip, unsure + standing.doubts
        # `with_upright_rest` drops a joint, even one of joints_to_keep, if none of its ancestors belongs to
        # the body.
        followed_joints = {
            joint: followed for joint, followed in followed_joints.items() if followed in clip.skeleton.joints
        }
    retargeting = plan(clip.skeleton, target, followed_joints)
    repairs = [DROPPED] if source.has_moving_joints else []
    if proportions == "clip":
        if match.rig == target.name:
            why = f"Its joints or its rest pose are not those of {target.name}"
        else:
            why = f"Its rig is {'unknown' if match.rig == UNKNOWN_RIG else match.rig}"
        repairs.append(
            f"{why}, so it could not keep its own bone lengths. It got the bone lengths of {target.name}."
        )
    new_clip = retarget_clip(clip, retargeting)
    return Fitted(
        new_clip,
        round(retargeting.scale, 6),
        repairs,
        compare_motions(clip, new_clip, retargeting.scale),
        unsure,
    )


def _reordered(clip: Clip, order: Array, target: Skeleton) -> Clip:
    """The clip with its joints in the target's order, and with its own bone lengths.

    order: for each joint of the target, the index of the same joint in the clip.
    """
    ends = {**target.end_sites, **clip.skeleton.end_sites}
    skeleton = replace(target, offsets=clip.skeleton.offsets[order], end_sites=ends)
    translations = None if clip.translations is None else clip.translations[:, order]
    return Clip(clip.name, skeleton, clip.fps, clip.rotations[:, order], clip.root, translations)


def _report(file: Bvh, source: FileMotion, new_clip: Clip) -> dict[str, Any]:
    """The part of the report that tells about the file, its rig and the new clip."""
    return {
        "clip": new_clip.name,
        "source": file.path.name,
        "sha256": file.sha256,
        "bytes": file.bytes,
        "source_frames": len(file),
        "source_start": source.first_frame,
        "source_fps": source.clip.fps,
        "frames": len(new_clip),
        "seconds": round(len(new_clip) / new_clip.fps, 3),
        "facing": round(float(np.degrees(first_facing(new_clip))), 1) + 0.0,
        "unit": source.unit,
        "unit_name": source.unit_name,
        "up": source.axes.up,
        "handedness": source.axes.handedness,
        "rest_facing": source.axes.facing,
        "rig": source.match.rig,
        "stance": source.rest_source,  # where the rest pose comes from, in words
        "roles": dict(source.match.roles),
    }
