"""Converts a BVH file to a clip on the target skeleton, and reports what was found and changed.

The target is the skeleton of the data set. The source is the file's motion on its own rig: the skeleton in
the file. A known skeleton is one that has a file in `config/skeletons`. Any other rig gets a standing rest
pose. The zero pose of a rig is the one in which all rotations are zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion.axes import RigAxes, straighten, turned_about_vertical
from hobble.motion.body import Body, body_by_roles, match_joints
from hobble.motion.edit import facing_angle, loop_clip, repair_defects, resample
from hobble.motion.ground import put_on_floor, tilt_problem
from hobble.motion.limbs import on_four_legs
from hobble.motion.options import ACCEPT, ClipMotion, MotionOptions, Problem, accept
from hobble.motion.other_formats import read_motion
from hobble.motion.physics import pace_problem, rate_problem
from hobble.motion.read import MOST_JOINT_POSES, Bvh, Decoded, check_angles, decode_channels, frame_rate
from hobble.motion.rest_pose import why_not_standing, with_upright_rest
from hobble.motion.retarget import compare_motions, difference_problems, knee_problem, plan, retarget_clip
from hobble.motion.rig import (
    LENGTH_OF_LEG,
    RigMatch,
    below_hips,
    body_in_file,
    clean_names,
    decode_below,
    find_hips,
    likely_unit,
    match_rig,
)
from hobble.motion.skeleton_file import KnownSkeleton, load_skeleton

STILL = 0.1  # cm: a joint that stays this close to its offset counts as fixed to its parent
SAME = 1e-3  # cm: offsets count as equal if they differ from the target skeleton's by at most this much
MOST_HEIGHT_ERROR = 3.0  # cm (two standard deviations): a clip whose height is more uncertain is refused
FEWEST_FRAMES = 5  # fewer frames show no motion
NO_MOTION = 0.01  # cm: a figure of which no joint moves further does not move
UNKNOWN_RIG = "found"  # stands in reports instead of the rig's name if the rig is no known skeleton


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
    file = read_motion(bvh)
    if options.frames is not None:
        file = _cut(file, *options.frames)
    source = load_source(file, target, skeleton_folder, options)
    _check_length(file, source.clip, target.skeleton, options)
    fitted = fit_skeleton(source, target.skeleton, options)
    made, repairs, loops = fitted.clip, source.repairs + fitted.repairs, options.loops
    problems = clip_problems(made, source.clip.fps, fitted.scale, options)
    if fitted.difference is not None:
        problems = [*difference_problems(file.path, fitted.difference, source.match.rig), *problems]
    doubts = fitted.unsure + accept(file.path, problems, options)
    if loops > 1:
        made = loop_clip(made, loops, options.heading)
        frames = len(made) // loops
        repairs.append(f"The cycle of {frames} frames was repeated {loops} times, with blended seams.")
    if options.facing is not None:
        made = turned_about_vertical(made, np.radians(options.facing) - facing_angle(made, 0))
    made = replace(made, name=clip)
    _check_finite(file, made)
    return made, {
        "clip": clip,
        "source": file.path.name,
        "sha256": file.sha256,
        "bytes": file.bytes,
        "source_frames": len(file),
        "source_start": source.first_frame,
        "source_fps": source.clip.fps,
        "frames": len(made),
        "seconds": round(len(made) / made.fps, 3),
        "facing": round(float(np.degrees(facing_angle(made, 0))), 1) + 0.0,
        "unit": source.unit,
        "unit_name": source.unit_name,
        "up": source.axes.up,
        "handedness": source.axes.handedness,
        "rest_facing": source.axes.facing,
        "rig": source.match.rig,
        "stance": source.rest_source,
        "roles": dict(source.match.roles),
        "loops": loops,
        "cycle_frames": len(made) // loops,
        "scale": fitted.scale,
        "retarget": fitted.difference,
        "unsure": doubts,
        "repairs": repairs,
        "notes": source.notes,
    }


def _cut(file: Bvh, first: int, last: int) -> Bvh:
    """The file with the frames `first` to `last` only, counted from 1. Raises InputError if it has fewer."""
    if last > len(file):
        fix = "Correct `frames` in the clip's entry."
        raise InputError(file.path, f"frames {first} to {last} are wanted, but it has {len(file)}", fix=fix)
    return replace(file, values=file.values[first - 1 : last], declared=last - first + 1)


def clip_problems(
    clip: Clip, source_fps: float, scale: float, options: MotionOptions
) -> list[Problem | None]:
    """What speaks against a clip: its motion, knees, pace, tilt and frame rate.

    source_fps: frame rate of its file. scale: size of the clip's figure / size of the captured person.
    `defects: leave` switches the checks of knees, pace and tilt off. The check of the knees is also off if
    the user has set the handedness, and the check of the tilt if the user has set the axis that points up.
    """
    found: list[Problem | None] = [_no_motion_problem(clip)]
    if options.defects != "leave":
        found.append(knee_problem(clip) if options.handedness == "auto" else None)
        found.append(pace_problem(clip))
        found.append(tilt_problem(clip) if options.up == "auto" else None)
    return [*found, rate_problem(clip, source_fps, scale)]


def _no_motion_problem(clip: Clip) -> Problem | None:
    """A clip of a few frames, or of a figure that never moves, such as a T-pose alone."""
    moved = np.ptp(clip.positions, axis=0).max()
    if len(clip) >= FEWEST_FRAMES and moved > NO_MOTION:
        return None
    seen = "one pose, held all the time, such as a T-pose or the zero pose"
    if moved > NO_MOTION:
        seen = f"{len(clip)} frames of {clip.fps:g} a second"
    return Problem(f"there is no motion in it, only {seen}", "Export the clip with its motion.")


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
    for values in (clip.rotations, clip.root, clip.positions):
        bad = ~np.isfinite(values).reshape(len(clip), -1).all(axis=1)
        if bad.any():
            short = ", ".join(file.names[j] for j in range(1, len(file.names)) if not file.offsets[j].any())
            why = f" (in the file, these joints have no length: {short:.200})" if short else ""
            raise InputError(
                file.path,
                f"the joints of {clip.skeleton.name} get rotations or positions that are not finite{why}",
                frame=int(np.argmax(bad)) + 1,
                fix="Check the OFFSETs and the values, and export the clip again.",
            )


@dataclass(frozen=True)
class FileMotion:
    """A file's motion at the file's own frame rate, in centimetres, right-handed, with Y up.

    It is on the file's own rig, or, if `has_standing_rig`, on a rig that has only the joints of the body and
    a standing rest pose.

    match: which known skeleton the rig is, if any, and which of the rig's joints each joint of the target
    follows. unit, unit_name: cm per unit of the file, and the unit in words. axes: which of the file's axes
    points up, and where the figure faces. rest_source: where the rest pose comes from, in words.
    has_moving_joints: whether any joint of the body except the hips moves relative to its parent. repairs,
    notes, unsure: sentences on what was repaired, on what else users should know, and on what is uncertain
    about the rest pose. first_frame: the file's frame (from 0) at which the clip begins.
    """

    clip: Clip
    match: RigMatch
    unit: float
    unit_name: str
    axes: RigAxes
    rest_source: str
    has_moving_joints: bool
    has_standing_rig: bool
    repairs: list[str]
    notes: list[str]
    unsure: list[str] = field(default_factory=list)
    first_frame: int = 0


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
    counted = []
    if len(file) != file.declared:
        problem = f"declares {file.declared} frames and has {len(file)}"
        if options.defects == "refuse":
            raise InputError(file.path, problem, fix="Export the clip again, or set motion.defects: repair.")
        counted = [f"The file {problem}. The {len(file)} frames are used."]
    source = _load_rig(file, target, skeleton_folder, options)
    clip, first, mended, notes = source.clip, 0, list[str](), source.notes
    if options.defects != "leave":
        clip, first, mended = repair_defects(clip)
        if options.ground == "flat":
            clip, floor_repairs, floor_notes = put_on_floor(clip)
            mended, notes = mended + floor_repairs, notes + floor_notes
    if mended and options.defects == "refuse":
        raise InputError(file.path, mended[0], fix="Set motion.defects: repair to repair it this way.")
    return replace(
        source, clip=clip, first_frame=first, repairs=counted + source.repairs + mended, notes=notes
    )


def _load_rig(file: Bvh, target: KnownSkeleton, folder: str | Path, options: ClipMotion) -> FileMotion:
    """A file's motion along Hobble's axes, on the rig of a known skeleton or with a standing rest pose.

    The match of a rig with another rest pose than that of its known skeleton only tells the parts of the
    body.
    """
    hips = find_hips(clean_names(file.names), target, folder)
    known = match_rig(rig_in_file(below_hips(file, hips)), target, folder)
    # The match has `followed_joints` if a map leads from the known skeleton to the target.
    is_known = known is not None and known.has_known_rest_pose and bool(known.followed_joints)
    decoded = decode_below(file, hips) if is_known else decode_channels(file)
    raw = raw_clip(below_hips(file, hips) if is_known else file, decoded)
    if is_known and known is not None:
        body, how_found = body_by_roles(replace(raw.skeleton, roles=known.roles)), list[str]()
    else:
        body, how_found = body_in_file(file.path, raw, known, options.handedness)
    leg = _leg_length(file, raw, body)
    standing = is_known or why_not_standing(body, LENGTH_OF_LEG / leg * rest_positions(raw.skeleton)) is None
    if not standing and on_four_legs(body, raw.positions):
        fix = "Only clips of figures with two legs can be used."
        raise InputError(file.path, "the figure goes on four legs", fix=fix)
    unit, unit_name, doubts = _unit(leg, options.unit)
    roles = known.roles if is_known and known else body.roles(raw.skeleton.joints)
    clip = _scaled(file, replace(raw.skeleton, roles=roles), decoded, unit, options)
    try:
        clip, axes, note, in_doubt = straighten(clip, options.up, options.handedness, standing)
    except ValueError as error:
        fix = "Set motion.up in the data set to Y or Z (option --up)."
        raise InputError(file.path, f"the up axis is in doubt: {error}", fix=fix) from None
    told = [note] if note else []
    source = FileMotion(
        clip,
        known or RigMatch(UNKNOWN_RIG, roles),
        unit,
        unit_name,
        # The standing rest pose that replaces another one faces +Z.
        axes if standing else replace(axes, facing="+Z"),
        rest_source="its zero pose",
        has_moving_joints=_has_moving_joints(decoded, body, unit),
        has_standing_rig=False,
        repairs=decoded.repairs,
        notes=decoded.notes + ([] if in_doubt else told) + how_found,
        unsure=doubts + (told if in_doubt else []),
    )
    return source if is_known else _with_standing_rig(file, source, body, target, options)


def _with_standing_rig(
    file: Bvh, source: FileMotion, body: Body, target: KnownSkeleton, options: ClipMotion
) -> FileMotion:
    """The motion on a rig that has only the joints of the body and a standing rest pose that faces +Z."""
    match = source.match
    # A rig with the target's own joint names is matched with the target by these names, and any other rig by
    # the parts of the body.
    named = match.followed_joints if match.rig == target.skeleton.name else {}
    index = source.clip.skeleton.index
    upright = with_upright_rest(source.clip, body, target.skeleton, [index(j) for j in named.values()])
    if upright.height_error > MOST_HEIGHT_ERROR and not options.accept_doubt:
        raise InputError(
            file.path,
            " ".join(upright.doubts),
            fix="Use a clip in which both feet stand flat, or one with a zero pose (all rotations zero) in "
            f"which a person could stand. {ACCEPT}",
        )
    rig = upright.clip.skeleton
    followed = named or match_joints(rig, upright.body, target.skeleton, body_by_roles(target.skeleton))
    return replace(
        source,
        clip=upright.clip,
        match=RigMatch(match.rig, rig.roles, False, followed),
        rest_source=upright.rest_source,
        has_standing_rig=True,
        unsure=source.unsure + upright.doubts,
    )


def raw_clip(file: Bvh, decoded: Decoded | None = None) -> Clip:
    """A file's motion in its own unit and axes, for uses in which the frame rate does not matter: it is 1."""
    found = decoded or decode_channels(file)
    return Clip(file.path.stem, rig_in_file(file), 1.0, found.rotations, found.root, found.translations)


def rig_in_file(file: Bvh) -> Skeleton:
    """The joints of a file as a skeleton, in the file's unit. Prefixes like "mixamorig:" are left out."""
    names = clean_names(file.names)
    new_name = dict(zip(file.names, names, strict=True))
    ends = {new_name[name]: sites[0] for name, sites in file.end_sites.items()}
    return Skeleton(file.path.stem, names, file.parents, file.offsets, end_sites=ends)


def _leg_length(file: Bvh, clip: Clip, body: Body) -> float:
    """Length of thigh and shank together, in the clip's unit: mean of both sides, median over the frames.

    Raises InputError if one of these bones has no length.
    """
    lengths = []
    for a, b in (bone for leg in body.legs.values() for bone in pairwise(leg[:3])):
        lengths.append(np.linalg.norm(clip.positions[:, b] - clip.positions[:, a], axis=-1))
        if np.median(lengths[-1]) < 1e-6:
            bone = f"{clip.skeleton.joints[a]} to {clip.skeleton.joints[b]}"
            fix = "Check its OFFSET and its position channels, and export the clip again."
            raise InputError(file.path, f"the bone from {bone} has no length", fix=fix)
    return float(np.median(sum(lengths)) / 2)


def _has_moving_joints(decoded: Decoded, body: Body, unit: float) -> bool:
    """Whether any joint of the body except its hips moves relative to its parent."""
    if decoded.translations is None:
        return False
    limb_joints = [j for limbs in (body.arms, body.legs) for limb in limbs.values() for j in limb]
    joints = [*body.trunk, *body.neck, body.head, *(j for j in limb_joints if j is not None)]
    local = decoded.translations[:, joints]
    return bool(np.abs(local - np.median(local, axis=0)).max() * unit > STILL)


def _unit(leg: float, unit: str | float) -> tuple[float, str, list[str]]:
    """Centimetres per unit of the file, the unit in words, and sentences on what is uncertain about it.

    leg: length of thigh and shank together, in the file's unit. unit: the option, a number or "auto". If no
    unit gives the rig a person's size, the rig gets that of an average adult.
    """
    if unit != "auto":
        return float(unit), f"{float(unit):g} cm (given)", []
    if (found := likely_unit(leg)) is not None:
        return *found, []
    doubt = (
        f"No unit gives this rig a person's size: thigh and shank together are {leg:.4g} units long. They "
        f"were taken to be {LENGTH_OF_LEG:g} cm long; motion.unit (option --unit) overrides this."
    )
    return LENGTH_OF_LEG / leg, "unknown", [doubt]


def _scaled(file: Bvh, rig: Skeleton, decoded: Decoded, unit: float, options: ClipMotion) -> Clip:
    """The decoded motion as a clip in centimetres, at the file's frame rate. unit: cm per file unit."""
    fps = options.source_fps or frame_rate(file.frame_time, file.frame_time_text)
    offsets = decoded.offsets * unit
    offsets[0] = 0.0
    ends = {joint: (x * unit, y * unit, z * unit) for joint, (x, y, z) in rig.end_sites.items()}
    skeleton = replace(rig, offsets=offsets, end_sites=ends)
    translations = None if decoded.translations is None else decoded.translations * unit
    return Clip(file.path.stem, skeleton, fps, decoded.rotations, decoded.root * unit, translations)


class Fitted(NamedTuple):
    """A clip on the joints of the target.

    source: the clip before, at the same frame rate. scale: length of the clip's path / length of the source's
    path. difference: how the clip differs from the source (see `compare_motions`), or None if it was not
    retargeted. repairs, unsure: sentences on what was changed, and on what is uncertain.
    """

    clip: Clip
    source: Clip
    scale: float
    difference: dict[str, Any] | None
    repairs: list[str]
    unsure: list[str]


def fit_skeleton(source: FileMotion, target: Skeleton, options: MotionOptions) -> Fitted:
    """Put a file's motion on the target skeleton, at the frame rate of the options.

    With `proportions: clip`, the clip keeps its own bone lengths if it has the target's joints and its bones
    point in the same directions in the rest pose.
    """
    match, moved = source.match, "Movements of joints relative to their parents were "
    clip, kept = resample(source.clip, options.fps), options.proportions == "clip"
    before = replace(clip, skeleton=replace(clip.skeleton, roles=match.roles))
    if match.is_target_skeleton:
        reordered = _reordered(clip, target)
        has_equal_offsets = np.abs(reordered.skeleton.offsets - target.offsets).max() <= SAME
        if has_equal_offsets or kept:
            reordered = replace(reordered, skeleton=target) if has_equal_offsets else reordered
            repairs = [f"{moved}kept."] if source.has_moving_joints else []
            return Fitted(reordered, before, 1.0, None, repairs, [])
    followed_joints, unsure = match.followed_joints, source.unsure
    # Retargeting needs a rest pose that stands. If `has_standing_rig` is True, `load_source` has made one.
    if not source.has_standing_rig:
        joints_to_keep = {clip.skeleton.index(name) for name in followed_joints.values()}
        standing = with_upright_rest(clip, body_by_roles(clip.skeleton), target, joints_to_keep)
        clip, unsure = standing.clip, unsure + standing.doubts
        # `with_upright_rest` drops a joint, even one of joints_to_keep, if none of its ancestors belongs to
        # the body.
        followed_joints = {a: b for a, b in followed_joints.items() if b in clip.skeleton.joints}
    how = plan(clip.skeleton, target, followed_joints)
    repairs = [f"{moved}dropped, because the bone lengths changed."] if source.has_moving_joints else []
    if kept:
        why = f"Its rig is {'unknown' if match.rig == UNKNOWN_RIG else match.rig}"
        if match.rig == target.name:
            why = f"Its joints or its rest pose are not those of {target.name}"
        repairs.append(
            f"{why}, so it could not keep its own bone lengths. It got the bone lengths of {target.name}."
        )
    made = retarget_clip(clip, how)
    return Fitted(made, before, round(how.scale, 6), compare_motions(clip, made, how.scale), repairs, unsure)


def _reordered(clip: Clip, target: Skeleton) -> Clip:
    """The clip with its joints in the target's order, and with its own bone lengths."""
    order = np.array([clip.skeleton.index(name) for name in target.joints])
    ends = {**target.end_sites, **clip.skeleton.end_sites}
    skeleton = replace(target, offsets=clip.skeleton.offsets[order], end_sites=ends)
    translations = None if clip.translations is None else clip.translations[:, order]
    return Clip(clip.name, skeleton, clip.fps, clip.rotations[:, order], clip.root, translations)
