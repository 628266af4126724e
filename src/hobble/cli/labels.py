"""Write automatic labels of a folder of BVH files, to be corrected by hand and read again.

hobble labels FOLDER OUT

For each clip it writes NAME_footsteps.txt, NAME_gait.txt and NAME.phase, in frames of the clip's own file.
Correct them, put them beside the clip, and the workflow takes them instead of its own labels.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from hobble.cli import batch
from hobble.core.errors import InputError
from hobble.core.section import Gait
from hobble.labels.files import SourceTime
from hobble.labels.label import label_clip
from hobble.labels.model import GAITS
from hobble.labels.options import Labels
from hobble.labels.write_files import write_label_files
from hobble.motion.make import make_clip
from hobble.motion.options import ClipMotion

ON = "holden31"  # the skeleton on which a clip is looked at; its labels hold for any


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What `hobble labels` takes."""
    batch.add_folders(parser, "the folder to write; FOLDER itself puts the files beside the clips")
    parser.add_argument("--gait", choices=GAITS, help="what the clips mostly show; it settles doubts")
    parser.add_argument("--source-fps", type=float, help="the files' rate, where their Frame Time is wrong")
    parser.add_argument("--overwrite", action="store_true", help="replace label files that are there")


def run(options: argparse.Namespace) -> int:
    """Label every clip; returns the exit status."""

    def label(name: str, file: Path) -> list[str]:
        return write_labels(name, file, options.out, options.gait, options.source_fps, options.overwrite)

    options.out.mkdir(parents=True, exist_ok=True)
    return batch.for_each(batch.clips_in(options.folder), label)


def write_labels(
    name: str, file: Path, out: Path, gait: Gait | None, source_fps: float | None, overwrite: bool
) -> list[str]:
    """Write the three files of one clip; returns what is odd about it.

    Raises InputError for a clip that cannot be read, and where a label file would be lost.
    """
    paths = [out / f"{name}{end}" for end in ("_footsteps.txt", "_gait.txt", ".phase")]
    there = [path.name for path in paths if path.exists()]
    if there and not overwrite:
        raise InputError(
            out, f"{', '.join(there)} would be replaced", fix="Say --overwrite, or name another folder."
        )
    skeleton = batch.skeleton_file(ON)
    clip, report = make_clip(
        file,
        skeleton,
        batch.skeleton_folder(),
        clip=name,
        skeleton_name=ON,
        options=ClipMotion(source_fps=source_fps),
    )
    labels, told = label_clip(clip, [], report, gait, "rocky", Labels())
    time = SourceTime(report["source_frames"], report["source_fps"], report["source_start"])
    write_label_files(paths[0], paths[1], paths[2], labels, time)
    seconds = np.bincount(labels.gait.argmax(axis=1), minlength=len(GAITS)) / clip.fps
    main = ", ".join(f"{s:.1f} s {g}" for s, g in zip(seconds, GAITS, strict=True) if s > 0)
    return [f"{len(labels.cycles)} cycles, {main}", *report["repairs"], *told.warnings]
