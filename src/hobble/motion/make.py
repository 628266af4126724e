"""Converts a BVH file to a clip on the target skeleton, and reports what was found and changed.

The target is the skeleton of the data set. The source is the file's motion on its own rig: the skeleton in
the file. A known skeleton is one that has a file in `config/skeletons`. Any other rig gets a standing rest
pose. The zero pose of a rig is the one in which all rotations are zero.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.skeleton import Skeleton, rest_positions
from hobble.motion import ACCEPT, ClipMotion, MotionOptions, Problem, accept
from hobble.motion.axes import changed, straighten
from hobble.motion.body import Body, body_by_roles, match_joints
from hobble.motion.edit import facing_angle, loop_clip, repair_defects, resample, sample_times
from hobble.motion.ground import put_on_floor, tilt_problem
from hobble.motion.limbs import on_four_legs
from hobble.motion.other_formats import read_motion
from hobble.motion.physics import pace_problem, rate_problem
from hobble.motion.read import MOST_JOINT_POSES, Bvh, check_angles, decode_channels, frame_rate
from hobble.motion.rest_pose import why_not_standing, with_upright_rest
from hobble.motion.retarget import compare_motions, difference_problems, knee_problem, plan, retarget_clip
from hobble.motion.rig import LENGTH_OF_LEG, RigMatch, below_hips, body_in_file, likely_unit, match_rig
from hobble.motion.skeleton_file import KnownSkeleton, load_skeleton

SAME = 1e-3  # cm: offsets count as equal if they differ from the target skeleton's by at most this much
MOST_HEIGHT_ERROR = 3.0  # cm (two standard deviations): a clip whose height is more uncertain is refused
FEWEST_FRAMES = 5  # of the finished clip; fewer show no motion
NO_MOTION = 1e-3  # degrees, or units of length: a file in which no value changes by more shows no motion
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
    that cannot be read, for an unsuitable skeleton, and for defects that cannot be repaired.
    """
    target = load_skeleton(skeleton, skeleton_name)
    file = read_motion(bvh, options.animation)
    if options.frames is not None:
        file = _cut(file, *options.frames)
    source = load_source(file, target, skeleton_folder, options)
    _check_length(file, source.clip, target.skeleton, options)
    made, scale, changes, doubts = fit_skeleton(source, target.skeleton, options)
    repairs, loops = source.repairs + changes, options.loops
    problems, difference = clip_problems(made, source.clip.fps, scale or 1.0, options), None
    if scale is not None:
        difference = compare_motions(resample(source.clip, options.fps), made)
        problems = [*difference_problems(file.path, difference, source.match.rig), *problems]
    doubts = doubts + accept(file.path, problems, options)
    if loops > 1:
        made = loop_clip(made, loops)
        frames = len(made) // loops
        repairs.append(f"The cycle of {frames} frames was repeated {loops} times, with blended seams.")
    made = replace(made, name=clip)
    _check_finite(file, made)
    return made, {
        "clip": clip,
        "source": file.path.name,
        "sha256": file.sha256,
        "bytes": file.bytes,
        "source_frames": len(file),
        **source.found,
        "source_fps": source.clip.fps,
        "frames": len(made),
        "seconds": round(len(made) / made.fps, 3),
        "facing": round(float(np.degrees(facing_angle(made, 0))), 1) + 0.0,
        "rig": source.match.rig,
        "roles": dict(source.match.roles),
        "loops": loops,
        "cycle_frames": len(made) // loops,
        "scale": 1.0 if scale is None else round(scale, 6),
        "retarget": difference,
        "unsure": doubts,
        "repairs": repairs,
        "notes": source.notes,
    }


def _cut(file: Bvh, first: int, last: int) -> Bvh:
    """The file with the frames `first` to `last` only, counted from 1. Raises InputError if it has fewer."""
    if last > len(file):
        fix = "Correct `frames` in the clip's entry."
        raise InputError(file.path, f"frames {first} to {last} are wanted, but it has {len(file)}", fix=fix)
    return replace(file, values=file.values[first - 1 : last])


def clip_problems(
    clip: Clip, source_fps: float, scale: float, options: MotionOptions
) -> list[Problem | None]:
    """What speaks against a clip: its knees, pace, tilt and frame rate.

    source_fps: frame rate of its file. scale: size of the clip's figure / size of the captured person.
    `defects: leave` switches the checks of knees, pace and tilt off. The check of the tilt is also off if the
    user has set the axis that points up.
    """
    found: list[Problem | None] = []
    if options.defects != "leave":
        found += [knee_problem(clip, options.handedness), pace_problem(clip)]
        found.append(tilt_problem(clip) if options.up == "auto" else None)
    return [*found, rate_problem(clip, source_fps, scale)]


def _no_motion_problem(file: Bvh, options: MotionOptions) -> Problem | None:
    """A file of a few frames, or of a figure that never moves, such as a T-pose alone."""
    frames = len(sample_times(len(file), _source_fps(file, options), options.fps))
    moves = np.ptp(file.values, axis=0).max() > NO_MOTION
    if frames >= FEWEST_FRAMES and moves:
        return None
    seen = "one pose, held all the time, such as a T-pose or the zero pose"
    if moves:
        seen = f"{len(file)} frames, which are {frames} at {options.fps:g} a second"
    return Problem(f"there is no motion in it, only {seen}", "Export the clip with its motion.")


def _source_fps(file: Bvh, options: MotionOptions) -> float:
    return options.source_fps or frame_rate(file.frame_time, file.frame_time_text)


def _check_length(file: Bvh, clip: Clip, target: Skeleton, options: ClipMotion) -> None:
    """Raise InputError for a clip that would need too much memory at its new frame rate, with all its loops.

    No real clip is that long: a wrong frame rate or number of loops is more likely.
    """
    frames = len(clip) / clip.fps * options.fps * options.loops
    if frames * max(len(clip.skeleton.joints), len(target.joints)) > MOST_JOINT_POSES:
        problem = f"{len(clip)} frames at {clip.fps:g} a second become {frames:.0f} at {options.fps:g}"
        most = f"frames times joints may be at most {MOST_JOINT_POSES}"
        fix = "Cut it into shorter clips, set its source_fps, or set fewer loops."
        raise InputError(file.path, f"{problem}; {most}", fix=fix)


def _check_finite(file: Bvh, clip: Clip) -> None:
    """Raise InputError if a number of the clip is not finite. The usual cause is bones without length."""
    for values in (clip.rotations, clip.root, clip.positions):
        bad = ~np.isfinite(values).reshape(len(clip), -1).all(axis=1)
        if bad.any():
            problem = f"the joints of {clip.skeleton.name} get rotations or positions that are not finite"
            fix = "Check the OFFSETs and the values, and export the clip again."
            raise InputError(file.path, problem, frame=int(np.argmax(bad)) + 1, fix=fix)


@dataclass(frozen=True)
class FileMotion:
    """A file's motion at the file's own frame rate, in centimetres, right-handed, with Y up.

    It is on the file's own rig if this is a known skeleton with its rest pose, and else on a rig that has
    only the joints of the body and a standing rest pose.

    match: which known skeleton the rig is, if any, and which of the rig's joints each joint of the target
    follows. found: entries of the report: `unit`, `up`, `handedness`, and `source_start` (the file's frame,
    from 0, at which the clip begins). repairs, notes, unsure: sentences on what was repaired, on what else
    users should know, and on what is uncertain.
    """

    clip: Clip
    match: RigMatch
    found: dict[str, Any]
    repairs: list[str]
    notes: list[str]
    unsure: list[str]


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
    still = accept(file.path, [_no_motion_problem(file, options)], options)
    source = _load_rig(file, target, skeleton_folder, options)
    clip, first, mended, unsure = source.clip, 0, list[str](), [*file.unsure, *still, *source.unsure]
    if options.defects != "leave":
        clip, first, mended = repair_defects(clip)
        if options.ground == "flat":
            clip, moved, doubts = put_on_floor(clip)
            mended, unsure = mended + moved, unsure + doubts
    found, repairs = {**source.found, "source_start": first}, source.repairs + mended
    return replace(source, clip=clip, found=found, repairs=repairs, unsure=unsure)


def _load_rig(file: Bvh, target: KnownSkeleton, folder: str | Path, options: ClipMotion) -> FileMotion:
    """A file's motion along Hobble's axes, on the rig of a known skeleton or with a standing rest pose."""
    whole, repairs = decode_channels(file)
    clip, notes = below_hips(whole, target, folder)
    known = match_rig(clip.skeleton, target, folder)
    if known is not None and known.is_usable:
        match = known
        body = body_by_roles(replace(clip.skeleton, roles=known.roles))
    else:
        # The match of a rig with another rest pose than its skeleton file only tells the parts of the body.
        body, notes = body_in_file(file.path, whole, known, options.handedness)
        clip = whole
        match = known or RigMatch(UNKNOWN_RIG, body.roles(clip.skeleton.joints))
    leg = _leg_length(file, clip, body)
    rest = LENGTH_OF_LEG / leg * rest_positions(clip.skeleton)
    stands = match.is_usable or why_not_standing(body, rest) is None
    if not stands and on_four_legs(body, clip.positions):
        fix = "Only clips of figures with two legs can be used."
        raise InputError(file.path, "the figure goes on four legs", fix=fix)
    unit, unsure = _unit(leg, options.unit)
    roles = match.roles if match.is_usable else body.roles(clip.skeleton.joints)
    clip = changed(clip, lambda vectors: vectors * unit, clip.rotations, clip.root * unit)
    clip = replace(clip, skeleton=replace(clip.skeleton, roles=roles), fps=_source_fps(file, options))
    clip.skeleton.offsets[0] = 0.0  # the root has no parent
    try:
        clip, axes, note, in_doubt = straighten(clip, options.up, options.handedness, stands)
    except ValueError as error:
        fix = "Set motion.up in the data set to Y or Z (option --up)."
        raise InputError(file.path, f"the up axis is in doubt: {error}", fix=fix) from None
    if note:
        (unsure if in_doubt else notes).append(note)
    if not match.is_usable:
        clip, match, doubts = _standing(file.path, clip, body, match, target.skeleton, options)
        unsure = unsure + doubts
    return FileMotion(clip, match, {"unit": unit, **axes}, repairs, notes, unsure)


def _standing(
    path: Path, clip: Clip, body: Body, match: RigMatch, target: Skeleton, options: ClipMotion
) -> tuple[Clip, RigMatch, list[str]]:
    """The motion on a rig that has only the joints of the body and a standing rest pose that faces +Z.

    Also returns its match with the target, and doubts.
    """
    # A rig with the target's own joint names is matched with the target by these names, and any other rig by
    # the parts of the body.
    named = match.followed_joints if match.rig == target.name else {}
    upright = with_upright_rest(clip, body, target, [clip.skeleton.index(j) for j in named.values()])
    if upright.height_error > MOST_HEIGHT_ERROR and not options.accept_doubt:
        fix = "Use a clip in which both feet stand flat, or one in whose zero pose a person could stand."
        raise InputError(path, " ".join(upright.doubts), fix=f"{fix} {ACCEPT}")
    rig = upright.clip.skeleton
    followed = named or match_joints(rig, upright.body, target, body_by_roles(target))
    return upright.clip, RigMatch(match.rig, rig.roles, followed), upright.doubts


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


def _unit(leg: float, unit: str | float) -> tuple[float, list[str]]:
    """Centimetres per unit of the file, and sentences on what is uncertain about it.

    leg: length of thigh and shank together, in the file's unit. unit: the option, a number or "auto". If no
    unit gives the rig a person's size, the rig gets that of an average adult.
    """
    if unit != "auto":
        return float(unit), []
    if (found := likely_unit(leg)) is not None:
        return found, []
    seen = f"No unit gives this rig a person's size: thigh and shank together are {leg:.4g} units long"
    used = f"They were taken for {LENGTH_OF_LEG:g} cm; motion.unit (option --unit) overrides this"
    return LENGTH_OF_LEG / leg, [f"{seen}. {used}."]


def fit_skeleton(
    source: FileMotion, target: Skeleton, options: MotionOptions
) -> tuple[Clip, float | None, list[str], list[str]]:
    """Put a file's motion on the target skeleton, at the frame rate of the options.

    Returns the clip; its scale, which is the length of its path / length of the source's path, or None if it
    was not retargeted; and sentences on what was changed, and on what is uncertain.

    With `proportions: clip`, the clip keeps its own bone lengths if it has the target's joints and its bones
    point in the same directions in the rest pose.
    """
    match, clip = source.match, resample(source.clip, options.fps)
    kept = options.proportions == "clip"
    if (
        match.rig == target.name
        and match.has_known_rest_pose
        and set(clip.skeleton.joints) == set(target.joints)
    ):
        reordered = _reordered(clip, target)
        has_equal_offsets = np.abs(reordered.skeleton.offsets - target.offsets).max() <= SAME
        if has_equal_offsets or kept:
            reordered = replace(reordered, skeleton=target) if has_equal_offsets else reordered
            return reordered, None, [], source.unsure
    followed_joints, unsure = match.followed_joints, source.unsure
    # Retargeting needs a rest pose that stands. Rigs that are no known skeleton have got one.
    if match.has_known_rest_pose:
        joints_to_keep = {clip.skeleton.index(name) for name in followed_joints.values()}
        standing = with_upright_rest(clip, body_by_roles(clip.skeleton), target, joints_to_keep)
        clip, unsure = standing.clip, unsure + standing.doubts
        # `with_upright_rest` drops a joint, even one of joints_to_keep, if none of its ancestors belongs to
        # the body.
        followed_joints = {a: b for a, b in followed_joints.items() if b in clip.skeleton.joints}
    how = plan(clip.skeleton, target, followed_joints)
    why = f"Its joints or its rest pose are not those of {target.name}"
    got = [f"{why}, so it got the bone lengths of {target.name} instead of its own."] if kept else []
    return retarget_clip(clip, how), how.scale, got, unsure


def _reordered(clip: Clip, target: Skeleton) -> Clip:
    """The clip with its joints in the target's order, and with its own bone lengths."""
    order = np.array([clip.skeleton.index(name) for name in target.joints])
    ends = {**target.end_sites, **clip.skeleton.end_sites}
    skeleton = replace(target, offsets=clip.skeleton.offsets[order], end_sites=ends)
    translations = None if clip.translations is None else clip.translations[:, order]
    return Clip(clip.name, skeleton, clip.fps, clip.rotations[:, order], clip.root, translations)
