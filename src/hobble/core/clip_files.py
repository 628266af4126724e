"""Finds the BVH file of each clip in a folder, and the files beside the clips that belong to none of them.

A clip has the name of its BVH file, without the suffix. Files with the same name and another suffix may stand
beside it: labels (footsteps, gait, phase), and where the person is hurt.
"""

import contextlib
import os
import re
from collections.abc import Collection, Iterator
from difflib import get_close_matches
from pathlib import Path

from hobble.core.errors import InputError
from hobble.core.files import check_regular

BVH_SUFFIX = ".bvh"
# A file beside a clip is called <clip><suffix>, with one of these suffixes.
SIDE_FILE_SUFFIXES = ("_footsteps.txt", "_injuries.txt", "_injuries", "_gait.txt", ".phase", ".gait")
VALID_NAME = re.compile(r"(?![.\s])[^{}<>\\/]+(?<!\s)")  # Snakemake would replace {x} and <x>
CLIP_NAME_RULE = (
    "no control characters, braces, angle brackets, slashes or backslashes, no dot or space first and no "
    "space last, 200 bytes at most"
)
# Bytes. Systems allow 255 bytes; the files that Hobble makes of a clip add up to 50 bytes to its name.
LONGEST_CLIP_NAME = 200
# The mirror image of a clip, and a hurt version of it, in which some links of the body are injured, have its
# name with an ending. It is their original.
MIRROR_SUFFIX = "_mirror"
HURT_SUFFIX = re.compile(r"_hurt([1-9]\d?)$")


def original(clip: str) -> str:
    """The clip from which a mirror or a hurt version is made; for other clips the clip itself."""
    return HURT_SUFFIX.sub("", clip.removesuffix(MIRROR_SUFFIX))


def is_hurt_version(clip: str) -> bool:
    """Whether a clip is a hurt version, or the mirror of one."""
    return HURT_SUFFIX.search(clip.removesuffix(MIRROR_SUFFIX)) is not None


def is_valid_clip_name(clip: str) -> bool:
    """Whether a clip's name works in a path, a log and a Snakemake wildcard; see CLIP_NAME_RULE."""
    is_short = len(clip.encode(errors="surrogateescape")) <= LONGEST_CLIP_NAME
    return is_short and clip.isprintable() and VALID_NAME.fullmatch(clip) is not None


def _files_in(folder: Path) -> Iterator[Path]:
    """The files in a folder and its subfolders, in alphabetical order of the folders, without hidden ones.

    Follows links, but enters each folder only once. Raises InputError if a folder cannot be read.
    """

    def raise_input_error(error: OSError) -> None:
        raise InputError(error.filename or folder, f"cannot be read: {error.strerror}") from None

    seen: set[str] = set()
    for here, folders, files in os.walk(folder, onerror=raise_input_error, followlinks=True):
        if (real := os.path.realpath(here)) in seen:
            folders.clear()  # os.walk enters the folders that this list has
            continue
        seen.add(real)
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        yield from (Path(here, name) for name in sorted(files) if not name.startswith("."))


def find_clips(folder: Path, suffixes: Collection[str] = (BVH_SUFFIX,)) -> dict[str, list[Path]]:
    """The BVH files (.bvh or .BVH) in a folder and its subfolders, as clip name -> paths.

    suffixes: other suffixes to find, in lower case. A clip has several paths if files in several folders have
    its name. Raises InputError if a folder cannot be read.
    """
    found: dict[str, list[Path]] = {}
    for path in _files_in(folder):
        if path.suffix.lower() in suffixes:
            found.setdefault(path.stem, []).append(path)
    return found


def require_single_file(clip: str, files: list[Path]) -> Path:
    """The only file in `files`, the BVH files of a clip.

    Raises InputError if there is more than one, or if the file is a device or a pipe.
    """
    if len(files) > 1:
        raise InputError(
            files[1],
            f"a second file of clip {clip}; the first is {files[0]}",
            fix="Rename one of them: a clip has the name of its file, whatever its folder.",
        )
    with contextlib.suppress(OSError):  # a broken link is reported when the clip is read
        check_regular(files[0])
    return files[0]


def clips_in(folder: Path, suffixes: Collection[str] = (BVH_SUFFIX,)) -> dict[str, Path]:
    """Clip name -> BVH file, for all files in a folder and its subfolders. `folder` may also be one file.

    suffixes: other suffixes to find, in lower case. Raises InputError if there are none, or if two files have
    the same clip name.
    """
    if folder.is_file():
        return {folder.stem: folder}
    if not folder.is_dir():
        raise InputError(folder, "no such file or folder")
    files = sorted(find_clips(folder, suffixes).items())
    found = {name: require_single_file(name, paths) for name, paths in files}
    if not found:
        raise InputError(folder, f"no {' or '.join(suffixes)} files here")
    return found


def unused_file_notes(folder: Path, clips: Collection[str]) -> list[str]:
    """Warnings about the files in a folder and its subfolders that belong to no clip.

    Only files with a suffix in SIDE_FILE_SUFFIXES count. clips: the names of all clips.
    """
    notes = []
    for path in _files_in(folder):
        suffix = next((suffix for suffix in SIDE_FILE_SUFFIXES if path.name.endswith(suffix)), None)
        if suffix and (stem := path.name.removesuffix(suffix)) not in clips:
            near = next(iter(get_close_matches(stem, clips, 1, 0.75)), None)
            fix = f"If it belongs to {near}, rename it." if near else "Rename it or take it out."
            notes.append(f"{path} belongs to no clip and is not read. {fix}")
    return notes
