"""Commands for BVH files that are in no data set yet: `python -m hobble.motion rig` and `look`."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from hobble.core.errors import HobbleError
from hobble.core.files import write_text
from hobble.motion.doubt import Doubt
from hobble.motion.draft import draft, guess_roles
from hobble.motion.file_motion import raw_clip, rig_of
from hobble.motion.find_body import find_body
from hobble.motion.look import look, table
from hobble.motion.options import ClipMotion
from hobble.motion.read import read_bvh
from hobble.motion.retarget_picture import picture_of_file

SKELETONS = Path("config/skeletons")  # the folder of the skeleton files


def rig(file: Path) -> str:
    """A draft of a skeleton file for the rig of a BVH file. Roles without a joint have `?`."""
    bvh = read_bvh(file)
    skeleton = rig_of(bvh)
    try:
        roles = find_body(skeleton.joints, skeleton.parents, raw_clip(bvh).positions).body.roles(
            skeleton.joints
        )
    except Doubt as doubt:
        print(f"{file}: {doubt}. Its roles are guessed from names", file=sys.stderr)
        roles = guess_roles(skeleton)
    return draft(skeleton, roles)


def main() -> int:
    """Run the command line. Returns 1 if a file is refused, else 0."""
    parser = argparse.ArgumentParser(prog="python -m hobble.motion", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    for_rig = commands.add_parser(
        "rig", help="write a draft of a skeleton file, which says which joint of a BVH file is which"
    )
    for_rig.add_argument("file", type=Path, help="a BVH file")
    for_rig.add_argument("--to", type=Path, help="the file to write (default: print it)")
    for_look = commands.add_parser(
        "look", help="try to read each clip of a folder, or one file; print a line about each"
    )
    for_look.add_argument("folder", type=Path, help="a folder of BVH files, or one file")
    for_look.add_argument(
        "--skeleton",
        default="holden31",
        help="name of the skeleton to which the clips are retargeted (default holden31)",
    )
    for_look.add_argument(
        "--skeletons", type=Path, default=SKELETONS, help="the folder of the skeleton files"
    )
    for_look.add_argument(
        "--handedness",
        choices=["auto", "right", "left"],
        default="auto",
        help="handedness of the files' coordinates, like the setting motion.handedness of a data set",
    )
    for_look.add_argument(
        "--picture",
        type=Path,
        metavar="SVG",
        help="for one file: draw its motion before and after retargeting, the joint that differs most in red",
    )
    given = parser.parse_args()
    try:
        if given.command == "rig":
            text = rig(given.file)
            write_text(given.to, text) if given.to else print(text, end="")
            return 0
        options = ClipMotion(handedness=given.handedness)
        target = given.skeletons / f"{given.skeleton}.yaml"
        if given.picture:
            write_text(given.picture, picture_of_file(given.folder, target, given.skeletons, options))
        seen = look(given.folder, target, given.skeletons, options)
        print(table(seen))
        return int(any(clip.refused for clip in seen.clips))
    except HobbleError as error:
        print(error, file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
