"""Turn a folder of BVH files into a folder of checked BVH files.

hobble motion FOLDER OUT --fps 60
hobble motion FOLDER OUT --skeleton holden31 --mirror

Files may have any rotation order, unit, axes and frame rate. Each file is checked, repaired if this is safe,
and written in centimetres, Y up. Rotations are interpolated as quaternions, not as Euler angles.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Literal

from hobble.cli import batch
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.motion.edit import loop_clip, mirror_clip, resample
from hobble.motion.make import load_source, make_clip
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh

# Roles tell which joint is the hips, the head, the left heel and so on. Without --skeleton, the joints of
# each file are matched with the roles of this skeleton.
ROLES_FROM = "holden31"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `hobble motion`."""
    batch.add_folders(parser, "the folder to write into; the clips keep their names")
    parser.add_argument("--fps", type=float, default=60.0, help="frame rate to write (default 60)")
    parser.add_argument(
        "--source-fps", type=float, help="frame rate of the files, if their Frame Time is wrong"
    )
    parser.add_argument(
        "--skeleton", help="retarget to this skeleton: a name from config/skeletons, or a YAML file"
    )
    parser.add_argument(
        "--mirror", action="store_true", help="also write each clip's mirror image, as CLIP_mirror.bvh"
    )
    parser.add_argument(
        "--loops", type=int, default=1, help="repeat each clip this many times; it must be one cycle"
    )
    parser.add_argument(
        "--refuse", action="store_true", help="refuse a file with broken frames instead of repairing them"
    )


def run(options: argparse.Namespace) -> int:
    """Convert every clip. Returns the exit status."""

    def convert(name: str, file: Path) -> list[str]:
        clip, notes = convert_file(name, file, options)
        write_bvh(options.out / f"{name}.bvh", clip)
        if options.mirror:
            write_bvh(options.out / f"{name}_mirror.bvh", mirror_clip(clip, f"{name}_mirror"))
        return notes

    options.out.mkdir(parents=True, exist_ok=True)
    return batch.process_clips(batch.clips_in(options.folder), convert)


def convert_file(name: str, file: Path, options: argparse.Namespace) -> tuple[Clip, list[str]]:
    """Convert a BVH file. Returns the clip and notes, such as what was repaired.

    name: of the clip. options: the arguments of `hobble motion`. Raises InputError for a bad file.
    """
    defects: Literal["repair", "refuse"] = "refuse" if options.refuse else "repair"
    settings = ClipMotion(source_fps=options.source_fps, defects=defects, loops=options.loops)
    folder = batch.skeleton_folder()
    if options.skeleton:
        target = batch.skeleton_file(options.skeleton)
        clip, report = make_clip(file, target, folder, clip=name, skeleton_name=target.stem, options=settings)
        return resample(clip, options.fps), report["repairs"] + report["unsure"] + report["notes"]
    source = load_source(read_bvh(file), batch.read_skeleton(ROLES_FROM), folder, settings)
    clip = resample(source.clip, options.fps)
    if options.loops > 1:
        clip = loop_clip(clip, options.loops, None)  # None: keep the heading
    return replace(clip, name=name), source.repairs + source.unsure + source.notes
