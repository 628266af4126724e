"""Commands for BVH files that are in no data set yet: `python -m hobble.motion rig` and `... look`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from hobble.core.errors import HobbleError
from hobble.core.files import write_text
from hobble.motion.limbs import Doubt, find_body
from hobble.motion.look import format_table, picture_of_file, summarise_clips
from hobble.motion.make import raw_clip, rig_in_file
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh
from hobble.motion.skeleton_file import draft_skeleton_file, guess_roles

SKELETONS = Path("config/skeletons")  # the folder of the skeleton files


def skeleton_draft(file: Path) -> str:
    """A draft of a skeleton file for the rig of a BVH file, with `?` for roles whose joint is not known."""
    bvh = read_bvh(file)
    skeleton = rig_in_file(bvh)
    try:
        body, _ = find_body(skeleton.joints, skeleton.parents, raw_clip(bvh).positions)
        roles = body.roles(skeleton.joints)
    except Doubt as doubt:
        print(f"{file}: {doubt}. The roles are guessed from the names of the joints.", file=sys.stderr)
        roles = guess_roles(skeleton)
    return draft_skeleton_file(skeleton, roles)


def main() -> int:
    """Run the command line. Returns the exit status: 1 after an error or if a clip is refused, else 0."""
    parser = argparse.ArgumentParser(prog="python -m hobble.motion", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    rig_parser = commands.add_parser(
        "rig", help="draft a skeleton file, which says which joint of a BVH file is which part of the body"
    )
    rig_parser.add_argument("file", type=Path, help="a BVH file")
    rig_parser.add_argument("--to", type=Path, help="the file to write (default: print it)")
    look_parser = commands.add_parser(
        "look", help="try to read each clip of a folder, or one file, and print a line about each clip"
    )
    look_parser.add_argument("folder", type=Path, help="a folder of BVH files, or one file")
    look_parser.add_argument(
        "--skeleton",
        default="holden31",
        help="name of the skeleton to which the clips are retargeted (default holden31)",
    )
    look_parser.add_argument(
        "--skeletons", type=Path, default=SKELETONS, help="the folder of the skeleton files"
    )
    look_parser.add_argument(
        "--handedness",
        choices=["auto", "right", "left"],
        default="auto",
        help="handedness of the files' coordinates, as in the setting motion.handedness of a data set "
        "(default auto: found from the motion)",
    )
    look_parser.add_argument(
        "--picture",
        type=Path,
        metavar="SVG",
        help="only if one file is given: the picture to write, which shows the motion before and after "
        "retargeting, and in red the joint or limb that differs most",
    )
    arguments = parser.parse_args()
    try:
        if arguments.command == "rig":
            text = skeleton_draft(arguments.file)
            write_text(arguments.to, text) if arguments.to else print(text, end="")
            return 0
        options = ClipMotion(handedness=arguments.handedness)
        target = arguments.skeletons / f"{arguments.skeleton}.yaml"
        if arguments.picture:
            write_text(
                arguments.picture, picture_of_file(arguments.folder, target, arguments.skeletons, options)
            )
        summary = summarise_clips(arguments.folder, target, arguments.skeletons, options)
        print(format_table(summary))
        return int(any(clip.refused for clip in summary.clips))
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
