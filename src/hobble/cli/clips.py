"""The subcommands of `hobble` for BVH files: look, rig, motion, labels, hurt, combine, injury."""

import argparse
import re
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from hobble.channels.injury.status import FPS, InjurySpell, Status, parse_links, write_status, write_statuses
from hobble.channels.shown import channel_display
from hobble.cli.command import (
    FOLDER,
    JSON,
    Argument,
    Message,
    add_motion_options,
    arg,
    command,
    motion_options,
    print_result,
    process_clips,
    progress,
)
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.files import write_text
from hobble.hurt.combine import PARTS, combine_clips
from hobble.hurt.hurt_clip import hurt_clip
from hobble.labels import LabelOptions
from hobble.labels.clip_labels import GAITS, Labels
from hobble.labels.label import label_clip
from hobble.labels.label_files import SourceTime, footsteps_text, gait_text
from hobble.motion import accept
from hobble.motion.edit import loop_clip, mirror_clip, resample
from hobble.motion.limbs import Doubt, find_body
from hobble.motion.look import draw_retargeting, format_table, summarise_clips
from hobble.motion.make import clip_problems, load_source, make_clip
from hobble.motion.other_formats import read_motion
from hobble.motion.read import decode_channels
from hobble.motion.skeleton_file import draft_skeleton_file, find_skeleton, load_skeleton, skeleton_folder

# Clips are retargeted to this skeleton before they are labelled; label files fit any skeleton, because they
# name no joints. `hobble motion` without --skeleton uses its roles, such as hips and left heel, to recognise
# the joints of each file.
SKELETON = "holden31"


def skeleton_argument(text: str) -> Argument:
    """The option --skeleton."""
    text = f"{text}: a name from config/skeletons, or a YAML file (default {SKELETON})"
    return arg("--skeleton", default=SKELETON, help=text)


def out(text: str) -> tuple[Argument, ...]:
    """The arguments of a command that makes files from each clip of a folder. text: help of OUT."""
    return FOLDER, arg("out", type=Path, help=text), JSON, add_motion_options


@command(
    "BVH files",
    FOLDER,
    skeleton_argument("skeleton to which the clips are retargeted"),
    arg("--skeletons", type=Path, help="folder of the skeleton files (default config/skeletons)"),
    arg("--picture", type=Path, metavar="SVG", help="draw one file's motion before and after retargeting"),
    JSON,
    add_motion_options,
)
def look(options: argparse.Namespace) -> int:
    """Try to read each clip of a folder, and print a line about each: rig, frame rate, steps, warnings.

    hobble look FOLDER
    hobble look FILE.bvh --picture apart.svg
    """
    settings, target = motion_options(options), find_skeleton(options.skeleton)
    folder = options.skeletons or skeleton_folder()
    if options.picture:
        draw_retargeting(options.picture, options.folder, target, folder, settings)
    summaries, notes = summarise_clips(options.folder, target, folder, settings, progress)
    clips = [{key: value for key, value in vars(clip).items() if key != "digest"} for clip in summaries]
    print_result(options, {"clips": clips, "notes": notes}, format_table(summaries, notes))
    return int(any(clip.refused for clip in summaries))


@command(
    "BVH files",
    arg("file", type=Path, help="a BVH file"),
    arg("--to", type=Path, help="the file to write (default: print it)"),
)
def rig(options: argparse.Namespace) -> int:
    """Draft a skeleton file, which says which joint of a BVH file is which part of the body.

    hobble rig FILE.bvh --to config/skeletons/mine.yaml
    """
    text = skeleton_draft(options.file)
    write_text(options.to, text) if options.to else print(text, end="")
    return 0


def skeleton_draft(file: Path) -> str:
    """A draft of a skeleton file for the rig of a BVH file, with `?` for roles whose joint is not known."""
    clip, _ = decode_channels(read_motion(file))
    skeleton = clip.skeleton
    try:
        body, _ = find_body(skeleton.joints, skeleton.parents, clip.positions)
    except Doubt as doubt:
        print(f"{file}: {doubt}.", file=sys.stderr)
        return draft_skeleton_file(skeleton, {})
    return draft_skeleton_file(skeleton, body.roles(skeleton.joints))


@command(
    "BVH files",
    *out("the folder to write into; the clips keep their names"),
    arg("--fps", type=float, default=60.0, help="frame rate to write (default 60)"),
    arg("--skeleton", help="retarget to this skeleton: a name from config/skeletons, or a YAML file"),
    arg("--mirror", action="store_true", help="also write each clip's mirror image, as CLIP_mirror.bvh"),
)
def motion(options: argparse.Namespace) -> int:
    """Turn a folder of BVH, glTF or FBX files into a folder of checked BVH files.

    hobble motion FOLDER OUT --fps 60
    hobble motion FOLDER OUT --skeleton holden31 --mirror

    Files may have any rotation order, unit, axes and frame rate. FBX files need Blender. Each file is
    checked, repaired if this is safe, and written in centimetres, Y up. Rotations are interpolated as
    quaternions, not as Euler angles.
    """

    def convert(name: str, file: Path) -> list[Message]:
        clip, notes = convert_file(name, file, options)
        write_bvh(options.out / f"{name}.bvh", clip)
        if options.mirror:
            write_bvh(options.out / f"{name}_mirror.bvh", mirror_clip(clip, f"{name}_mirror"))
        return notes

    return process_clips(options, convert)


def convert_file(name: str, file: Path, options: argparse.Namespace) -> tuple[Clip, list[Message]]:
    """Convert a BVH file. Returns the clip and notes, such as what was repaired.

    name: of the clip. options: the arguments of `hobble motion`. Raises InputError for a bad file.
    """
    settings = motion_options(options)
    if options.skeleton:
        target = find_skeleton(options.skeleton)
        clip, report = make_clip(file, target, skeleton_folder(), name, target.stem, settings)
        return resample(clip, options.fps), report_messages(report)
    target_file, folder = load_skeleton(find_skeleton(SKELETON)), skeleton_folder()
    source = load_source(read_motion(file, settings.animation), target_file, folder, settings)
    doubts = accept(file, clip_problems(source.clip, source.clip.fps, 1.0, settings), settings)
    clip = resample(source.clip, options.fps)
    if settings.loops > 1:
        clip = loop_clip(clip, settings.loops)
    found = {"unsure": source.unsure + doubts, "repairs": source.repairs, "notes": source.notes}
    return replace(clip, name=name), report_messages(found)


def report_messages(report: Mapping[str, Any]) -> list[Message]:
    """The doubts, repairs and notes of a clip's report."""
    kinds = {"doubt": "unsure", "repair": "repairs", "note": "notes"}
    return [(kind, sentence) for kind, key in kinds.items() for sentence in report[key]]


@command(
    "BVH files",
    *out("the folder to write into; if it is FOLDER, label files lie beside the clips"),
    arg("--gait", choices=GAITS, help="the main gait of the clips; used where the gait is unclear"),
    arg("--overwrite", action="store_true", help="replace existing label files"),
)
def labels(options: argparse.Namespace) -> int:
    """Label a folder of BVH files and write label files that you can correct.

    hobble labels FOLDER OUT

    For each clip, two files are written: CLIP_footsteps.txt and CLIP_gait.txt. They tell when the feet land,
    from which the phase follows, and which gait each frame has. Frame numbers are those of the clip's file.
    Correct the files and put them beside the clip. The workflow then uses them instead of its own labels.
    """
    return process_clips(options, lambda name, file: write_labels(name, file, options))


def write_labels(name: str, file: Path, options: argparse.Namespace) -> list[Message]:
    """Write the two label files of one clip. Returns notes and warnings.

    file: the clip's BVH file. options: the arguments of `hobble labels`. Raises InputError if the clip cannot
    be read, or if a label file exists already and is not to be overwritten.
    """
    paths = [options.out / f"{name}{end}" for end in ("_footsteps.txt", "_gait.txt")]
    existing = [path.name for path in paths if path.exists()]
    if existing and not options.overwrite:
        problem = f"{', '.join(existing)} would be replaced"
        raise InputError(options.out, problem, fix="Use --overwrite, or write into another folder.")
    clip, report, found, warnings = _labelled(name, file, options)
    time = SourceTime(report["source_frames"], report["source_fps"], report["source_start"])
    for path, text in zip(paths, (footsteps_text, gait_text), strict=True):
        write_text(path, text(found, time))
    # Seconds of each gait, for the note.
    seconds = np.bincount(found.gait.argmax(axis=1), minlength=len(GAITS)) / clip.fps
    gaits = ", ".join(f"{s:.1f} s {g}" for s, g in zip(seconds, GAITS, strict=True) if s > 0)
    about = ("found", f"{len(found.cycles)} cycles, {gaits}")
    return [about, *(("warning", warning) for warning in warnings), *report_messages(report)]


def _labelled(
    name: str, file: Path, options: argparse.Namespace
) -> tuple[Clip, dict[str, Any], Labels, tuple[str, ...]]:
    """A clip on the skeleton SKELETON, its report, its labels, and warnings about these."""
    # Without --ground the ground is unknown. It must not be called "flat", because on flat ground the height
    # of the head alone decides whether a person crouches.
    ground = options.ground or "rocky"
    clip, report = make_clip(
        file, find_skeleton(SKELETON), skeleton_folder(), name, SKELETON, motion_options(options)
    )
    gait = getattr(options, "gait", None)
    found, label_report = label_clip(clip, [], report, gait, ground, LabelOptions())
    return clip, report, found, label_report.warnings


@command(
    "what hurts",
    *out("the folder to write into: CLIP_limps.bvh and CLIP_limps_injuries.txt"),
    arg("--injury", required=True, help="what hurts: PART[severity];..."),
)
def hurt(options: argparse.Namespace) -> int:
    """Write clips as a body with these injuries walks them, with the status files of what hurts.

    hobble hurt FOLDER OUT --injury 'left knee[7];LeftArm-LeftForeArm[3]'

    A part is a link of the skeleton holden31, to which the clips are retargeted, or its name in words.
    Severities are 0 to 10.
    """
    skeleton = load_skeleton(find_skeleton(SKELETON)).skeleton
    links = skeleton.link_names
    named = channel_display("injury", skeleton, links, links).other_names
    given = re.sub(r"[^;\[]+(?=\[)", lambda part: named.get(part[0].strip(), part[0]), options.injury)
    pairs = parse_links(given, links, "--injury")
    values = dict(pairs)

    def make(name: str, file: Path) -> list[Message]:
        clip, _, found, warnings = _labelled(name, file, options)
        severity = np.tile([values.get(link, 0.0) for link in clip.skeleton.link_names], (len(clip), 1))
        result = hurt_clip(clip, found, severity, f"{name}_limps", flat=options.ground in (None, "flat"))
        write_bvh(options.out / f"{name}_limps.bvh", result.clip)
        frames = len(result.clip)
        status = Status(frames, (InjurySpell(1, frames, pairs),))
        write_status(options.out / f"{name}_limps_injuries.txt", status)
        about = ("found", f"{len(clip) / FPS:.1f} s became {frames / FPS:.1f} s")
        return [*(("warning", warning) for warning in warnings), about]

    return process_clips(options, make)


@command(
    "what hurts",
    arg("body", type=Path, help="the BVH file whose path, legs and trunk are kept"),
    arg("other", type=Path, help="the BVH file from which a part of the body is taken"),
    arg("out", type=Path, help="the BVH file to write"),
    arg("--part", choices=list(PARTS), default="arms", help="what is taken (default arms)"),
    JSON,
    add_motion_options,
)
def combine(options: argparse.Namespace) -> int:
    """Combine two clips by parts of the body, such as the legs of one with the arms of another.

    hobble combine LEGS.bvh ARMS.bvh OUT.bvh --part arms

    Both are retargeted to the skeleton holden31. The steps of the second clip keep time with those of the
    first.
    """
    pairs = [_labelled(file.stem, file, options) for file in (options.body, options.other)]
    (body, _, labels, warnings), (other, _, other_labels, more) = pairs
    name = options.out.stem
    write_bvh(options.out, combine_clips(body, labels, other, other_labels, options.part, name))
    print_result(options, str(options.out), "\n".join([*warnings, *more, str(options.out)]))
    return 0


@command(
    "what hurts",
    arg("table", type=Path, help="CSV with the columns clip, link, severity, from, to"),
    arg("folder", type=Path, help="folder with the clips' BVH files"),
    skeleton_argument("skeleton that lists the links"),
    JSON,
)
def injury(options: argparse.Namespace) -> int:
    """Write status files from a table. A status file says which links hurt in a clip, when and how much.

    hobble injury TABLE.csv FOLDER

    TABLE.csv has the columns clip, link (such as LeftLeg-LeftFoot), severity (0 to 10), from, to. `from` and
    `to` are frames of the clip's file, counted from 1. An empty `from` means the first frame, an empty `to`
    the last. FOLDER has the clips' BVH files. For each clip of the table, the command writes a file
    CLIP_injuries.txt beside the clip's BVH file, where the workflow looks for it.
    """
    links = load_skeleton(find_skeleton(options.skeleton)).skeleton.link_names
    paths = [str(path) for path in write_statuses(options.table, options.folder, links)]
    print_result(options, paths, "\n".join(paths))
    return 0
