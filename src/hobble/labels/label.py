"""Labels a clip: finds its contacts from the motion, and its phase and gait from files or from the motion."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.files import write_json
from hobble.core.quat import Array
from hobble.labels import LabelOptions as Options
from hobble.labels.clip_labels import GAITS, LabelReport, Labels, label_curves
from hobble.labels.footfall import find_landings, find_stance_contacts, find_still_joints, find_swings
from hobble.labels.gait import automatic_gait, overwrite_crouch
from hobble.labels.label_files import SourceTime, read_footsteps, read_gait, read_gait_keys, read_phase
from hobble.labels.phase import (
    dropped_frames,
    find_cycles,
    footsteps_of_phase,
    mirrored_footsteps,
    phase_of_footsteps,
    rows_of_landings,
)

# A clip gets a warning if the shares of time in which its left and its right heel are down differ by more.
UNLIKE_HEELS = 0.3
# How the name of a label file ends -> its kind.
KINDS = {".phase": "phase", ".gait": "gait", "_footsteps.txt": "footsteps", "_gait.txt": "gait_keys"}


def label_clip(
    clip: Clip,
    files: Iterable[str | Path],
    motion: Mapping[str, Any],
    gait: str | None,
    ground: str,
    options: Options,
) -> tuple[Labels, LabelReport]:
    """Label a clip. Returns its labels, and a report that says where they come from.

    files: hand-made label files beside the clip's BVH file. `.phase` has priority over `_footsteps.txt`,
    `.gait` has priority over `_gait.txt`. motion: the report beside the clip's motion, with `source_frames`
    (number of frames of the BVH file), `source_fps` (its frame rate), `source_start` (its frame that is frame
    0 of the clip) and `loops` (how often the clip repeats it). gait: the clip's main gait, if known. ground:
    "flat", or another kind of ground. options: the section `labels` of the data set. Raises InputError for an
    invalid file.
    """
    paths = [Path(file) for file in files if options.files]
    label_files = {kind: path for path in paths for end, kind in KINDS.items() if path.name.endswith(end)}
    warnings: list[str] = []
    if label_files and motion.get("loops", 1) > 1:
        names = ", ".join(path.name for path in label_files.values())
        cycle = "their frame numbers are those of one cycle, but the clip repeats this cycle"
        warnings.append(f"{names} not used: {cycle}")
        label_files = {}
    time = SourceTime(motion["source_frames"], motion["source_fps"], motion.get("source_start", 0))
    stances = find_stance_contacts(clip)
    phase, known, footsteps = _find_phase(clip, label_files, time)
    if "gait" in label_files:
        shares = read_gait(label_files["gait"], time, len(clip))
    elif "gait_keys" in label_files:
        shares = read_gait_keys(label_files["gait_keys"], time, len(clip))
    else:
        shares = automatic_gait(clip, stances, gait)
    if ground == "flat":
        shares = overwrite_crouch(shares, clip)
    known &= ~dropped_frames(footsteps, len(clip))
    zero = options.phase_zero
    cycles, dropped = find_cycles(footsteps, len(clip), zero, options.margins, options.between)
    if not len(cycles):
        warnings.append("no whole gait cycle, so no frame of the clip is trained on")
    contacts = find_still_joints(clip) if options.contacts == "original" else stances
    left, right = contacts[:, 0].mean(), contacts[:, 2].mean()
    if abs(left - right) > UNLIKE_HEELS:
        warnings.append(
            f"the left heel is down in {left:.0%} of the frames, the right heel in {right:.0%}: look whether "
            "the person limps, or whether a foot of the rig is wrong"
        )
    phase = phase if zero == "right" else (phase + 0.5) % 1.0
    report = LabelReport(
        clip=clip.name,
        phase_source="file" if {"phase", "footsteps"} & label_files.keys() else "automatic",
        gait_source="file" if {"gait", "gait_keys"} & label_files.keys() else "automatic",
        phase_zero=zero,
        margins=options.margins,
        cycles_dropped=dropped,
        between=options.between,
        warnings=tuple(warnings),
    )
    return Labels(contacts, phase, known, shares, footsteps, cycles), report


def mirror_labels(labels: Labels, report: LabelReport, clip: Clip) -> tuple[Labels, LabelReport]:
    """The labels of a mirrored clip, and their report.

    labels, report: of the original clip. clip: the mirrored clip. Left and right contacts are swapped, and
    the phase is half a cycle later. A cycle of the mirrored clip begins where the other foot lands in the
    original.
    """
    footsteps = mirrored_footsteps(labels.footsteps)
    cycles, dropped = find_cycles(footsteps, len(labels), report.phase_zero, report.margins, report.between)
    contacts, phase = labels.contacts[:, [2, 3, 0, 1]], (labels.phase + 0.5) % 1.0
    mirrored = replace(labels, contacts=contacts, phase=phase, footsteps=footsteps, cycles=cycles)
    return mirrored, replace(report, clip=clip.name, cycles_dropped=dropped)


def write_report(path: str | Path, report: LabelReport, labels: Labels, clip: Clip) -> None:
    """Write the JSON file beside the labels.

    It holds the report; the seconds of each gait; the number of cycles; and the curves of a picture of the
    labels (see `label_curves`).
    """
    main_gait = np.argmax(labels.gait, axis=1)
    seconds = {name: float(np.sum(main_gait == i) / clip.fps) for i, name in enumerate(GAITS)}
    found = {"seconds": seconds, "cycles": len(labels.cycles), "curves": label_curves(labels, clip)}
    write_json(path, {**asdict(report), **found})


def _find_phase(clip: Clip, files: Mapping[str, Path], time: SourceTime) -> tuple[Array, np.ndarray, Array]:
    """Find the phase from files or, without files, from the swings of the feet.

    Returns the phase (F,), which is 0 when the right foot lands; for each frame whether the phase is known,
    bool (F,); and the footsteps (N, 3), see `hobble.labels.phase`. files: kind, see KINDS -> file.
    """
    frames = len(clip)
    if "footsteps" in files:
        footsteps = read_footsteps(files["footsteps"], time)
    else:
        footsteps = rows_of_landings(find_landings(find_swings(clip), frames))
    if "phase" not in files:
        return *phase_of_footsteps(footsteps, frames), footsteps
    phase = read_phase(files["phase"], time, frames)
    from_phase, known = footsteps_of_phase(phase)
    return phase, known, footsteps if "footsteps" in files else from_phase
