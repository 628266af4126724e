"""Label a folder of BVH files and write label files that you can correct.

hobble labels FOLDER OUT

For each clip, three files are written: CLIP_footsteps.txt, CLIP_gait.txt and CLIP.phase. They tell when the
feet land, and which gait and phase each frame has. Frame numbers are those of the clip's file. Correct the
files and put them beside the clip. The workflow then uses them instead of its own labels.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from hobble.cli import batch
from hobble.core.errors import InputError
from hobble.core.section import Gait
from hobble.labels.clip_labels import GAITS
from hobble.labels.label import label_clip
from hobble.labels.label_files import SourceTime, write_label_files
from hobble.labels.options import LabelOptions
from hobble.motion.make import make_clip
from hobble.motion.options import ClipMotion

# Clips are retargeted to this skeleton before they are labelled. The label files can be used with any
# skeleton, because they name no joints.
SKELETON = "holden31"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `hobble labels`."""
    batch.add_folders(parser, "the folder to write into; if it is FOLDER, label files lie beside the clips")
    parser.add_argument(
        "--gait", choices=GAITS, help="the main gait of the clips; used where the gait is unclear"
    )
    parser.add_argument(
        "--source-fps", type=float, help="frame rate of the files, if their Frame Time is wrong"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace existing label files")


def run(options: argparse.Namespace) -> int:
    """Label every clip. Returns the exit status."""

    def label(name: str, file: Path) -> list[str]:
        return write_labels(name, file, options.out, options.gait, options.source_fps, options.overwrite)

    options.out.mkdir(parents=True, exist_ok=True)
    return batch.process_clips(batch.clips_in(options.folder), label)


def write_labels(
    name: str, file: Path, out: Path, gait: Gait | None, source_fps: float | None, overwrite: bool
) -> list[str]:
    """Write the three label files of one clip. Returns notes and warnings.

    file: the clip's BVH file. out: the folder to write into. gait: the main gait, if known. source_fps: frame
    rate of the file, if its Frame Time is wrong. Raises InputError if the clip cannot be read, or if a label
    file exists already and `overwrite` is False.
    """
    paths = [out / f"{name}{end}" for end in ("_footsteps.txt", "_gait.txt", ".phase")]
    existing = [path.name for path in paths if path.exists()]
    if existing and not overwrite:
        raise InputError(
            out,
            f"{', '.join(existing)} would be replaced",
            fix="Use --overwrite, or write into another folder.",
        )
    skeleton = batch.skeleton_file(SKELETON)
    clip, report = make_clip(
        file,
        skeleton,
        batch.skeleton_folder(),
        clip=name,
        skeleton_name=SKELETON,
        options=ClipMotion(source_fps=source_fps),
    )
    # The ground is unknown. It must not be called "flat", because on flat ground the height of the head alone
    # decides whether a person crouches.
    labels, label_report = label_clip(clip, [], report, gait, "rocky", LabelOptions())
    time = SourceTime(report["source_frames"], report["source_fps"], report["source_start"])
    write_label_files(paths[0], paths[1], paths[2], labels, time)
    # Seconds of each gait, for the note.
    seconds = np.bincount(labels.gait.argmax(axis=1), minlength=len(GAITS)) / clip.fps
    gaits = ", ".join(f"{s:.1f} s {g}" for s, g in zip(seconds, GAITS, strict=True) if s > 0)
    return [f"{len(labels.cycles)} cycles, {gaits}", *report["repairs"], *label_report.warnings]
