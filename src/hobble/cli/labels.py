"""Label a folder of BVH files and write label files that you can correct.

hobble labels FOLDER OUT

For each clip this writes CLIP_footsteps.txt, CLIP_gait.txt and CLIP.phase, with the frame numbers of the
clip's file. Correct them and put them beside the clip. The workflow then uses them instead of its own labels.
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
from hobble.labels.options import LabelOptions
from hobble.labels.read_files import SourceTime
from hobble.labels.write_files import write_label_files
from hobble.motion.make import make_clip
from hobble.motion.options import ClipMotion

# Clips are retargeted to this skeleton for labelling. The label files fit any skeleton.
SKELETON = "holden31"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `hobble labels`."""
    batch.add_folders(
        parser, "the folder to write into; it may be FOLDER, so that the files lie beside the clips"
    )
    parser.add_argument("--gait", choices=GAITS, help="the main gait of the clips; decides unclear cases")
    parser.add_argument(
        "--source-fps", type=float, help="frame rate of the files, if their Frame Time is wrong"
    )
    parser.add_argument("--overwrite", action="store_true", help="replace existing label files")


def run(options: argparse.Namespace) -> int:
    """Label every clip. Returns the exit status."""

    def label(name: str, file: Path) -> list[str]:
        return write_labels(name, file, options.out, options.gait, options.source_fps, options.overwrite)

    options.out.mkdir(parents=True, exist_ok=True)
    return batch.for_each(batch.clips_in(options.folder), label)


def write_labels(
    name: str, file: Path, out: Path, gait: Gait | None, source_fps: float | None, overwrite: bool
) -> list[str]:
    """Write the three label files of one clip. Returns notes and warnings.

    Raises InputError for a clip that cannot be read, and for label files that exist already, unless
    `overwrite`.
    """
    paths = [out / f"{name}{end}" for end in ("_footsteps.txt", "_gait.txt", ".phase")]
    there = [path.name for path in paths if path.exists()]
    if there and not overwrite:
        raise InputError(
            out, f"{', '.join(there)} would be replaced", fix="Use --overwrite or another folder."
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
    labels, checked = label_clip(clip, [], report, gait, "rocky", LabelOptions())
    time = SourceTime(report["source_frames"], report["source_fps"], report["source_start"])
    write_label_files(paths[0], paths[1], paths[2], labels, time)
    seconds = np.bincount(labels.gait.argmax(axis=1), minlength=len(GAITS)) / clip.fps
    gaits = ", ".join(f"{s:.1f} s {g}" for s, g in zip(seconds, GAITS, strict=True) if s > 0)
    return [f"{len(labels.cycles)} cycles, {gaits}", *report["repairs"], *checked.warnings]
