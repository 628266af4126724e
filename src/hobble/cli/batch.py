"""Functions for several subcommands: to process each BVH file of a folder, and to find skeleton files."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from tqdm import tqdm

from hobble.core.clip_files import find_clips, require_single_file
from hobble.core.errors import HobbleError, InputError
from hobble.motion.skeleton_file import KnownSkeleton, load_skeleton


def add_folders(parser: argparse.ArgumentParser, out: str) -> None:
    """Add the arguments FOLDER and OUT to a subcommand. out: help text of OUT."""
    parser.add_argument("folder", type=Path, help="a folder of BVH files, or one file")
    parser.add_argument("out", type=Path, help=out)


def clips_in(folder: Path) -> dict[str, Path]:
    """Clip name -> BVH file, for all files in a folder and its subfolders. `folder` may also be one file.

    Raises InputError if there are none, or if two files have the same clip name.
    """
    if folder.is_file():
        return {folder.stem: folder}
    if not folder.is_dir():
        raise InputError(folder, "no such file or folder")
    found = {name: require_single_file(name, files) for name, files in sorted(find_clips(folder).items())}
    if not found:
        raise InputError(folder, "no .bvh files here")
    return found


def process_clips(clips: dict[str, Path], process: Callable[[str, Path], list[str]]) -> int:
    """Call `process(name, file)` for every clip. Print the notes that it returns, and a summary.

    clips: name -> file. If a clip fails, its error message is printed, and the next clip is processed.
    Returns the exit status: 1 if a clip failed, else 0.
    """
    failed = 0
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


def skeleton_folder() -> Path:
    """The folder of the skeleton files, in the repository or else in the installed package."""
    package = Path(__file__).resolve().parents[1]
    in_repository = package.parents[1] / "config" / "skeletons"
    return in_repository if in_repository.is_dir() else package / "skeletons"


def skeleton_file(name: str) -> Path:
    """The path of a skeleton file. name: a skeleton's name, or a path to a YAML file.

    Raises InputError if there is no skeleton of that name.
    """
    if name.endswith((".yaml", ".yml")):
        return Path(name)
    folder = skeleton_folder()
    path = folder / f"{name}.yaml"
    if not path.is_file():
        known = ", ".join(sorted(p.stem for p in folder.glob("*.yaml")))
        raise InputError(path, "no such skeleton", fix=f"Use {known}, or the path of a YAML file.")
    return path


def read_skeleton(name: str) -> KnownSkeleton:
    """Read a skeleton, and which of its joints are which joints of other skeletons.

    name: a skeleton's name, or a path to a YAML file. Raises InputError if the file is missing or wrong.
    """
    path = skeleton_file(name)
    return load_skeleton(path, path.stem)
