"""Labels a clip: finds its contacts from the motion, and its phase and gait from files or from the motion."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.files import write_json
from hobble.core.quat import Array
from hobble.labels import read_files as label_files
from hobble.labels.clip_labels import GAITS, LabelReport, Labels
from hobble.labels.contacts import contacts, stance
from hobble.labels.footfall import Swing, find_swings, landings
from hobble.labels.gait import automatic_gait, overwrite_crouch
from hobble.labels.label_picture import label_picture
from hobble.labels.options import LabelOptions as Options
from hobble.labels.phase import (
    MARGINS,
    dropped_frames,
    find_cycles,
    footsteps_of_phase,
    mirrored_footsteps,
    phase_of_footsteps,
    rows_of_landings,
)
from hobble.labels.read_files import SourceTime


def label_clip(
    clip: Clip,
    files: Iterable[str | Path],
    motion: Mapping[str, Any],
    gait: str | None,
    ground: str,
    options: Options,
) -> tuple[Labels, LabelReport]:
    """Label a clip.

    files: hand-made files beside the clip's BVH file. `.phase` has priority over `_footsteps.txt`, `.gait`
    over `_gait.txt`. motion: the report of the motion stage, of which `source_fps`, `source_frames`,
    `source_start` and `loops` are read. gait: the clip's main gait, if known. ground: "flat", or another kind
    of ground. options: the section `labels` of the data set. Raises InputError for an invalid file.
    """
    given = _by_kind(files) if options.files else {}
    warnings: list[str] = []
    if given and motion.get("loops", 1) > 1:
        warnings.append(_not_used(given))
        given = {}
    time = SourceTime(motion["source_frames"], motion["source_fps"], motion.get("source_start", 0))
    swings = find_swings(clip, options)
    phase, known, footsteps = _phase(clip, given, time, swings, options.shortest_step)
    shares = _gait(clip, given, time, options, gait)
    if ground == "flat":
        shares = overwrite_crouch(shares, clip)
    known &= ~dropped_frames(footsteps, len(clip))
    zero = options.phase_zero
    cycles, dropped = find_cycles(footsteps, len(clip), zero, options.margins)
    if not len(cycles):
        warnings.append(_no_cycle(options.margins))
    labels = Labels(
        contacts=contacts(clip, options),
        phase=phase if zero == "right" else (phase + 0.5) % 1.0,
        phase_known=known,
        gait=shares,
        footsteps=footsteps,
        cycles=cycles,
    )
    report = LabelReport(
        clip=clip.name,
        phase_source="file" if {"phase", "footsteps"} & given.keys() else "automatic",
        gait_source="file" if {"gait", "gait_keys"} & given.keys() else "automatic",
        phase_zero=zero,
        margins=options.margins,
        cycles_dropped=dropped,
        warnings=tuple(warnings),
    )
    return labels, report


def _not_used(given: Mapping[str, Path]) -> str:
    names = ", ".join(path.name for path in given.values())
    return f"{names} not used: their frame numbers are those of one cycle, but the clip repeats this cycle"


def _no_cycle(margins: str) -> str:
    where = f" with {MARGINS[margins]} frames of the clip before and {MARGINS[margins] + 1} after it"
    return f"no whole gait cycle{where if margins == 'drop' else ''}, so no frame of the clip is trained on"


def mirror_labels(labels: Labels, report: LabelReport, clip: Clip) -> tuple[Labels, LabelReport]:
    """Labels of the mirrored clip: left and right contacts are swapped, and the phase is half a cycle later.

    labels, report: of the clip that is mirrored. clip: the mirrored clip. Its cycles begin where the other
    foot lands in the clip that is mirrored.
    """
    footsteps = mirrored_footsteps(labels.footsteps)
    cycles, dropped = find_cycles(footsteps, len(labels), report.phase_zero, report.margins)
    mirrored = Labels(
        contacts=labels.contacts[:, [2, 3, 0, 1]],
        phase=(labels.phase + 0.5) % 1.0,
        phase_known=labels.phase_known,
        gait=labels.gait,
        footsteps=footsteps,
        cycles=cycles,
    )
    values = {**asdict(report), "clip": clip.name, "cycles_dropped": dropped}
    return mirrored, LabelReport(**values)


def write_report(path: str | Path, report: LabelReport, labels: Labels, clip: Clip) -> None:
    """Write the JSON beside the labels: the report, seconds of each gait and data of the label picture."""
    main = np.argmax(labels.gait, axis=1)
    seconds = {name: float(np.sum(main == i) / clip.fps) for i, name in enumerate(GAITS)}
    write_json(
        path,
        {
            **asdict(report),
            "seconds": seconds,
            "cycles": len(labels.cycles),
            "curves": label_picture(labels, clip),
        },
    )


def _by_kind(files: Iterable[str | Path]) -> dict[str, Path]:
    """Kind of a label file (phase, gait, footsteps, gait_keys) -> file."""
    suffixes = {
        ".phase": "phase",
        ".gait": "gait",
        "_footsteps.txt": "footsteps",
        "_gait.txt": "gait_keys",
    }
    out = {}
    for file in files:
        for suffix, kind in suffixes.items():
            if str(file).endswith(suffix):
                out[kind] = Path(file)
    return out


def _phase(
    clip: Clip, given: Mapping[str, Path], time: SourceTime, swings: list[Swing], shortest_step: int
) -> tuple[Array, np.ndarray, Array]:
    """Phase (F,), 0 as the right foot lands; bool (F,), whether it is known; and footsteps (N, 3)."""
    frames = len(clip)
    if "footsteps" in given:
        footsteps = label_files.read_footsteps(given["footsteps"], time)
    if "phase" in given:
        phase = label_files.read_phase(given["phase"], time, frames)
        from_phase, known = footsteps_of_phase(phase)
        return phase, known, footsteps if "footsteps" in given else from_phase
    if "footsteps" not in given:
        footsteps = rows_of_landings(landings(swings, frames, shortest_step))
    phase, known = phase_of_footsteps(footsteps, frames)
    return phase, known, footsteps


def _gait(
    clip: Clip, given: Mapping[str, Path], time: SourceTime, options: Options, dominant: str | None
) -> Array:
    if "gait" in given:
        return label_files.read_gait(given["gait"], time, len(clip))
    if "gait_keys" in given:
        return label_files.read_gait_keys(given["gait_keys"], time, len(clip))
    return automatic_gait(clip, stance(clip, options), dominant)
