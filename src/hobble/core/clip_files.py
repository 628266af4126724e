"""Finds the BVH file of each clip in a folder, and the label files that belong to no clip."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Collection
from difflib import get_close_matches
from pathlib import Path

from hobble.core.errors import InputError
from hobble.core.untrusted import check_regular

SUFFIX = ".bvh"
# The name of a label or status file is the name of its clip with one of these at the end.
SIDE_FILE_SUFFIXES = ("_footsteps.txt", "_injuries.txt", "_injuries", "_gait.txt", ".phase", ".gait")
VALID_NAME = re.compile(r"(?![.\s])[^{}<>\\/]+(?<!\s)")  # Snakemake fills in {x} and <x>
CLIP_NAME_RULE = (
    "no control characters, braces, angle brackets, slashes or backslashes, no dot or space first and no "
    "space last, 200 bytes at most"
)
# Bytes. Files of a clip have names that are up to 50 bytes longer, and systems allow 255 bytes.
LONGEST_CLIP_NAME = 200


def is_valid_clip_name(clip: str) -> bool:
    """Whether a clip's name works in a path, a log and a Snakemake wildcard; see CLIP_NAME_RULE."""
    short = len(clip.encode(errors="surrogateescape")) <= LONGEST_CLIP_NAME
    return short and clip.isprintable() and VALID_NAME.fullmatch(clip) is not None


def find_clips(folder: Path) -> dict[str, list[Path]]:
    """Clip -> its BVH files (.bvh or .BVH) in a folder and its subfolders, sorted.

    Follows links, but enters each folder only once. Skips hidden files and folders. Raises InputError if a
    folder cannot be read.
    """

    def refuse(error: OSError) -> None:
        raise InputError(error.filename or folder, f"cannot be read: {error.strerror}") from None

    found: dict[str, list[Path]] = {}
    seen: set[str] = set()
    for here, folders, files in os.walk(folder, onerror=refuse, followlinks=True):
        if (real := os.path.realpath(here)) in seen:
            folders.clear()
            continue
        seen.add(real)
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(files):
            stem, suffix = os.path.splitext(name)
            if suffix.lower() == SUFFIX and not name.startswith("."):
                found.setdefault(stem, []).append(Path(here, name))
    return found


def only_file(clip: str, files: list[Path]) -> Path:
    """The one file of a clip. Raises InputError if there are more, or if the file is a device or a pipe."""
    if len(files) > 1:
        raise InputError(
            files[1],
            f"a second file of clip {clip}; the first is {files[0]}",
            fix="Rename one of them: a clip has the name of its file, whatever its folder.",
        )
    with contextlib.suppress(OSError):  # a broken link is reported when the clip is read
        check_regular(files[0])
    return files[0]


def unused_file_notes(folder: Path, clips: Collection[str]) -> list[str]:
    """A sentence for each label or status file in a folder or its subfolders that belongs to no clip."""
    out = []
    for here, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(files):
            suffix = next((suffix for suffix in SIDE_FILE_SUFFIXES if name.endswith(suffix)), None)
            if suffix and (stem := name.removesuffix(suffix)) not in clips:
                near = next(iter(get_close_matches(stem, clips, 1, 0.75)), None)
                fix = f"If it belongs to {near}, rename it." if near else "Rename it or take it out."
                out.append(f"{Path(here, name)} belongs to no clip and is not read. {fix}")
    return out
