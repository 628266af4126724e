"""Converts a BVH file to a clip on the target skeleton, with a report of what was found and done."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.axes import turned
from hobble.motion.body import body_by_roles
from hobble.motion.check_retarget import check, check_knees, compare
from hobble.motion.file_motion import FOUND, FileMotion, load_source
from hobble.motion.loop import loop_clip
from hobble.motion.options import ClipMotion
from hobble.motion.pace import check_pace
from hobble.motion.read import MOST_POSES, Bvh, read_bvh
from hobble.motion.resample import sample_positions, sample_rotations, sample_times
from hobble.motion.retarget import plan, retarget_clip
from hobble.motion.rig import load_skeleton
from hobble.motion.root import facing
from hobble.motion.tilt import check_tilt
from hobble.motion.upright_rest import with_upright_rest

SAME = 1e-3  # cm: offsets that differ from the target skeleton's by less count as equal

KEPT = "Movements of joints relative to their parents were kept."
DROPPED = "Movements of joints relative to their parents were dropped, because the bone lengths changed."


def make_clip(
    bvh: str | Path,
    skeleton: str | Path,
    maps: str | Path,
    clip: str,
    skeleton_name: str,
    options: ClipMotion,
) -> tuple[Clip, dict[str, Any]]:
    """Read a BVH file, check it, and convert it to the skeleton at the frame rate of `options`.

    skeleton: file of the target skeleton. maps: the folder of the skeleton files. clip: name of the new clip.
    skeleton_name: name of the target skeleton. options: the `motion` section of the data set, with the values
    of the clip's entry.

    Returns the clip and its report (the content of `motion/<clip>.json`). Raises InputError for a file
    that cannot be read, for an unsuitable skeleton, and for defects that cannot be repaired; with
    `defects: refuse`, for all defects.
    """
    target = load_skeleton(skeleton, skeleton_name)
    file = read_bvh(bvh)
    source = load_source(file, target, maps, options)
    _check_length(file, source.clip, target.skeleton, options)
    resampled = resample(source.clip, options.fps)
    fitted = fit_skeleton(resampled, source, target.skeleton, options.proportions)
    if fitted.difference is not None:
        check(file.path, fitted.difference, source.match.rig)
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
        new_clip = turned(new_clip, np.radians(options.facing) - first_facing(new_clip))
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
    """Raise InputError for a clip that would take more memory at the new frame rate than any real clip."""
    frames = len(clip) / clip.fps * options.fps * options.loops
    if frames * max(len(clip.skeleton.joints), len(target.joints)) > MOST_POSES:
        raise InputError(
            file.path,
            f"{len(clip)} frames at {clip.fps:g} a second become {frames:.0f} at {options.fps:g}: more "
            f"than {MOST_POSES} poses of a joint",
            fix="Cut it into shorter clips, or set its source_fps.",
        )


def _check_finite(file: Bvh, clip: Clip) -> None:
    """Raise InputError for values that are not finite, which come from joints without length."""
    lengths = np.linalg.norm(file.offsets, axis=1)
    for values in (clip.rotations, clip.root, clip.positions):
        bad = ~np.isfinite(values).reshape(len(clip), -1).all(axis=1)
        if bad.any():
            short = ", ".join(
                name for name, length in zip(file.names[1:], lengths[1:], strict=True) if not length
            )
            why = f" (joints without length: {short:.200})" if short else ""
            raise InputError(
                file.path,
                f"gives no motion of {clip.skeleton.name}{why}",
                frame=int(np.argmax(bad)) + 1,
                fix="Check the OFFSETs and the values, and export the clip again.",
            )


def first_facing(clip: Clip) -> float:
    """Facing direction in the first frame, radians from +Z towards +X."""
    ahead = facing(clip.skeleton, clip.positions[:1], 0.0)[0]
    return float(np.arctan2(ahead[0], ahead[2]))


def resample(clip: Clip, fps: float) -> Clip:
    """The clip at another frame rate. A frame at the time of an old frame equals it exactly."""
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
    """A clip on the joints of the target.

    scale: length of its path / length of the source's path. repairs: sentences on what was changed.
    difference: how the clip differs from the source (from `hobble.motion.check_retarget.compare`), or None if
    it was not retargeted.
    unsure: sentences on what is uncertain.
    """

    clip: Clip
    scale: float
    repairs: list[str]
    difference: dict[str, Any] | None = None
    unsure: list[str] = field(default_factory=list)


def fit_skeleton(clip: Clip, source: FileMotion, target: Skeleton, proportions: str) -> Fitted:
    """The clip's motion on the target skeleton, or on its joints with the clip's own bone lengths.

    clip: that of `source` at the new frame rate. proportions: "skeleton" for the target's bone lengths,
    "clip" to keep the clip's own where possible.
    """
    match = source.match
    if match.same:
        reordered = _reordered(clip, np.array([clip.skeleton.index(name) for name in target.joints]), target)
        same = np.abs(reordered.skeleton.offsets - target.offsets).max() <= SAME
        if same or proportions == "clip":
            reordered = replace(reordered, skeleton=target) if same else reordered
            return Fitted(reordered, 1.0, [KEPT] if source.moving else [])
    sources, unsure = match.sources, source.unsure
    if not source.straightened:
        followed_joints = {clip.skeleton.index(name) for name in sources.values()}
        standing = with_upright_rest(clip, body_by_roles(clip.skeleton), target, followed_joints)
        clip, unsure = standing.clip, unsure + standing.notes
        sources = {joint: followed for joint, followed in sources.items() if followed in clip.skeleton.joints}
    retargeting = plan(clip.skeleton, target, sources)
    repairs = [DROPPED] if source.moving else []
    if proportions == "clip":
        rig = "unknown" if match.rig == FOUND else match.rig
        why = f"Its rig is {rig}, so it could not keep its own bone lengths"
        repairs.append(f"{why}. It got the bone lengths of {target.name}.")
    new_clip = retarget_clip(clip, retargeting)
    return Fitted(
        new_clip, round(retargeting.scale, 6), repairs, compare(clip, new_clip, retargeting.scale), unsure
    )


def _reordered(clip: Clip, order: Array, target: Skeleton) -> Clip:
    ends = {**target.end_sites, **clip.skeleton.end_sites}
    skeleton = replace(target, offsets=clip.skeleton.offsets[order], end_sites=ends)
    translations = None if clip.translations is None else clip.translations[:, order]
    return Clip(clip.name, skeleton, clip.fps, clip.rotations[:, order], clip.root, translations)


def _report(file: Bvh, source: FileMotion, new_clip: Clip) -> dict[str, Any]:
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
        "stance": source.stance,
        "roles": dict(source.match.roles),
    }
