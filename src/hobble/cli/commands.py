"""The subcommands of `hobble` for folders of clips and for a trained character.

The docstring of each class is its help text.
"""

from __future__ import annotations

import argparse
import sys
import webbrowser
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from hobble.channels.injury.table import skeleton_links, write_statuses
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.clip_files import clips_in
from hobble.core.errors import HobbleError, InputError
from hobble.labels.clip_labels import GAITS
from hobble.labels.label import label_clip
from hobble.labels.label_files import SourceTime, write_label_files
from hobble.labels.options import LabelOptions
from hobble.motion.edit import loop_clip, mirror_clip, resample
from hobble.motion.make import load_source, make_clip
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh
from hobble.motion.skeleton_file import find_skeleton, load_skeleton, skeleton_folder

# Clips are retargeted to this skeleton before they are labelled; label files fit any skeleton, because they
# name no joints. `hobble motion` without --skeleton uses its roles, such as hips and left heel, to recognise
# the joints of each file.
SKELETON = "holden31"


class Motion:
    """Turn a folder of BVH files into a folder of checked BVH files.

    hobble motion FOLDER OUT --fps 60
    hobble motion FOLDER OUT --skeleton holden31 --mirror

    Files may have any rotation order, unit, axes and frame rate. Each file is checked, repaired if this is
    safe, and written in centimetres, Y up. Rotations are interpolated as quaternions, not as Euler angles.
    """

    @staticmethod
    def add_arguments(parser: argparse.ArgumentParser) -> None:
        """Add the arguments of `hobble motion`."""
        _add_folders(parser, "the folder to write into; the clips keep their names")
        add = parser.add_argument
        add("--fps", type=float, default=60.0, help="frame rate to write (default 60)")
        add("--skeleton", help="retarget to this skeleton: a name from config/skeletons, or a YAML file")
        add("--mirror", action="store_true", help="also write each clip's mirror image, as CLIP_mirror.bvh")
        add("--loops", type=int, default=1, help="repeat each clip this many times; it must be one cycle")
        refuse = "refuse a file with broken frames instead of repairing them"
        add("--refuse", action="store_true", help=refuse)

    @staticmethod
    def run(options: argparse.Namespace) -> int:
        """Convert every clip. Returns the exit status."""

        def convert(name: str, file: Path) -> list[str]:
            clip, notes = convert_file(name, file, options)
            write_bvh(options.out / f"{name}.bvh", clip)
            if options.mirror:
                write_bvh(options.out / f"{name}_mirror.bvh", mirror_clip(clip, f"{name}_mirror"))
            return notes

        return process_clips(options, convert)


def convert_file(name: str, file: Path, options: argparse.Namespace) -> tuple[Clip, list[str]]:
    """Convert a BVH file. Returns the clip and notes, such as what was repaired.

    name: of the clip. options: the arguments of `hobble motion`. Raises InputError for a bad file.
    """
    settings = ClipMotion(
        source_fps=options.source_fps,
        defects="refuse" if options.refuse else "repair",
        loops=options.loops,
    )
    folder, target = skeleton_folder(), find_skeleton(options.skeleton or SKELETON)
    if options.skeleton:
        clip, report = make_clip(file, target, folder, name, target.stem, settings)
        return resample(clip, options.fps), report["repairs"] + report["unsure"] + report["notes"]
    source = load_source(read_bvh(file), load_skeleton(target), folder, settings)
    clip = resample(source.clip, options.fps)
    if options.loops > 1:
        clip = loop_clip(clip, options.loops)
    return replace(clip, name=name), source.repairs + source.unsure + source.notes


class Labels:
    """Label a folder of BVH files and write label files that you can correct.

    hobble labels FOLDER OUT

    For each clip, three files are written: CLIP_footsteps.txt, CLIP_gait.txt and CLIP.phase. They tell when
    the feet land, and which gait and phase each frame has. Frame numbers are those of the clip's file.
    Correct the files and put them beside the clip. The workflow then uses them instead of its own labels.
    """

    @staticmethod
    def add_arguments(parser: argparse.ArgumentParser) -> None:
        """Add the arguments of `hobble labels`."""
        _add_folders(parser, "the folder to write into; if it is FOLDER, label files lie beside the clips")
        gait = "the main gait of the clips; used where the gait is unclear"
        parser.add_argument("--gait", choices=GAITS, help=gait)
        parser.add_argument("--overwrite", action="store_true", help="replace existing label files")

    @staticmethod
    def run(options: argparse.Namespace) -> int:
        """Label every clip. Returns the exit status."""
        return process_clips(options, lambda name, file: write_labels(name, file, options))


def write_labels(name: str, file: Path, options: argparse.Namespace) -> list[str]:
    """Write the three label files of one clip. Returns notes and warnings.

    file: the clip's BVH file. options: the arguments of `hobble labels`. Raises InputError if the clip cannot
    be read, or if a label file exists already and is not to be overwritten.
    """
    paths = [options.out / f"{name}{end}" for end in ("_footsteps.txt", "_gait.txt", ".phase")]
    existing = [path.name for path in paths if path.exists()]
    if existing and not options.overwrite:
        problem = f"{', '.join(existing)} would be replaced"
        raise InputError(options.out, problem, fix="Use --overwrite, or write into another folder.")
    settings = ClipMotion(source_fps=options.source_fps)
    clip, report = make_clip(file, find_skeleton(SKELETON), skeleton_folder(), name, SKELETON, settings)
    # The ground is unknown. It must not be called "flat", because on flat ground the height of the head alone
    # decides whether a person crouches.
    labels, label_report = label_clip(clip, [], report, options.gait, "rocky", LabelOptions())
    time = SourceTime(report["source_frames"], report["source_fps"], report["source_start"])
    write_label_files(paths[0], paths[1], paths[2], labels, time)
    # Seconds of each gait, for the note.
    seconds = np.bincount(labels.gait.argmax(axis=1), minlength=len(GAITS)) / clip.fps
    gaits = ", ".join(f"{s:.1f} s {g}" for s, g in zip(seconds, GAITS, strict=True) if s > 0)
    return [f"{len(labels.cycles)} cycles, {gaits}", *report["repairs"], *label_report.warnings]


def _add_folders(parser: argparse.ArgumentParser, out: str) -> None:
    """Add the arguments of both subcommands for folders of clips. out: help text of OUT."""
    parser.add_argument("folder", type=Path, help="a folder of BVH files, or one file")
    parser.add_argument("out", type=Path, help=out)
    source_fps = "frame rate of the files, if their Frame Time is wrong"
    parser.add_argument("--source-fps", type=float, help=source_fps)


def process_clips(options: argparse.Namespace, process: Callable[[str, Path], list[str]]) -> int:
    """Call `process(name, file)` for every clip. Print the notes that it returns, and a summary.

    If a clip fails, its error message is printed, and the next clip is processed. options: the arguments
    FOLDER and OUT. Returns the exit status: 1 if a clip failed, else 0.
    """
    options.out.mkdir(parents=True, exist_ok=True)
    clips, failed = clips_in(options.folder), 0
    bar = tqdm(clips.items(), unit=" clips", disable=None, file=sys.stderr)
    for name, file in bar:
        try:
            notes = process(name, file)
        except HobbleError as error:
            failed += 1
            notes = [f"{error}"]
        for note in notes:
            # An error message already begins with the path of the file.
            bar.write(note if note.startswith(str(file)) else f"{name}: {note}")
    done = len(clips) - failed
    print(f"{done} of {len(clips)} clips done" + (f", {failed} failed: see above" if failed else ""))
    return 1 if failed else 0


class Injury:
    """Write status files from a table. A status file says which links hurt in a clip, when and how much.

    hobble injury TABLE.csv FOLDER

    TABLE.csv has the columns clip, link (such as LeftLeg-LeftFoot), severity (0 to 10), from, to. `from` and
    `to` are frames of the clip's file, counted from 1. An empty `from` means the first frame, an empty `to`
    the last. FOLDER has the clips' BVH files. For each clip of the table, the command writes a file
    CLIP_injuries.txt beside the clip's BVH file, where the workflow looks for it.
    """

    @staticmethod
    def add_arguments(parser: argparse.ArgumentParser) -> None:
        """Add the arguments of `hobble injury`."""
        parser.add_argument("table", type=Path, help="CSV with the columns clip, link, severity, from, to")
        parser.add_argument("folder", type=Path, help="folder with the clips' BVH files")
        skeleton = f"skeleton that lists the links (default {SKELETON})"
        parser.add_argument("--skeleton", default=SKELETON, help=skeleton)

    @staticmethod
    def run(options: argparse.Namespace) -> int:
        """Write the status files and print their paths. Returns the exit status."""
        links = skeleton_links(find_skeleton(options.skeleton))
        for path in write_statuses(options.table, options.folder, links):
            print(path)
        return 0


class Play:
    """Open the page on which you control a trained character with the keyboard.

    hobble play                    opens the newest report under results/
    hobble play results/injured    opens the report of the configuration `injured`
    """

    @staticmethod
    def add_arguments(parser: argparse.ArgumentParser) -> None:
        """Add the arguments of `hobble play`."""
        results = "results/<configuration>, or a report file; default: the newest report"
        parser.add_argument("results", nargs="?", type=Path, help=results)
        parser.add_argument("--print", action="store_true", help="print the address, open no browser")

    @staticmethod
    def run(options: argparse.Namespace) -> int:
        """Open the page. Returns the exit status."""
        address = find_report(options.results).resolve().as_uri() + "#play"
        print(address)
        if not options.print and not webbrowser.open(address):
            print("No browser could be started. Open the address above in one.")
        return 0


def find_report(results: Path | None) -> Path:
    """The path of a report. results: a report, or the folder that holds it; None: the newest under results/.

    If there is no report, raises InputError with the command that makes one.
    """
    if results is None:
        found = sorted(Path("results").glob("*/report.html"), key=lambda path: path.stat().st_mtime)
        if not found:
            raise InputError("results", "holds no report", fix="`make report` makes one.")
        return found[-1]
    path = results / "report.html" if results.is_dir() or results.suffix != ".html" else results
    if not path.is_file():
        raise InputError(path, "no such report", fix=f"`snakemake -c2 {path}` makes it.")
    return path
