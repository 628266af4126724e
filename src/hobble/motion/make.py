"""Converts a BVH file to a clip on the target skeleton, and reports what was found and changed.

The target is the skeleton of the data set. The source is the file's motion on its own rig.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.axes import turned_about_vertical
from hobble.motion.body import body_by_roles
from hobble.motion.check_retarget import check_difference, check_knees, compare_motions
from hobble.motion.file_motion import UNKNOWN_RIG, FileMotion, load_source
from hobble.motion.loop import loop_clip
from hobble.motion.options import ClipMotion
from hobble.motion.pace import check_pace
from hobble.motion.read import MOST_JOINT_POSES, Bvh, read_bvh
from hobble.motion.resample import sample_positions, sample_rotations, sample_times
from hobble.motion.retarget import plan, retarget_clip
from hobble.motion.rig import load_skeleton
from hobble.motion.root import facing_directions
from hobble.motion.tilt import check_tilt
from hobble.motion.upright_rest import with_upright_rest

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


def resample(clip: Clip, fps: float) -> Clip:
    """The clip at another frame rate. New frames at the times of old frames are exactly equal to these."""
    if clip.fps == fps:
        return clip
    times = sample_times(len(clip), clip.fps, fps)
    return replace(
        clip,
        fps=fps,
        rotations=sample_rotations(clip.rotations, times),
        root=sample_positions(clip.root, times),
        translations=None if clip.translations is None else sample_positions(clip.translations, times),
    )


@dataclass(frozen=True)
class Fitted:
    """The result of `fit_skeleton`: a clip on the joints of the target.

    scale: length of the clip's path / length of the source's path. repairs: sentences on what was changed.
    difference: how the clip differs from the source (see `hobble.motion.check_retarget.compare_motions`), or
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
