"""The BVH files of a folder by the names of their clips, and the files beside them that belong to none."""

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
# What is read beside a clip: its name and one of these; the longer goes before the shorter.
BESIDE = ("_footsteps.txt", "_injuries.txt", "_injuries", "_gait.txt", ".phase", ".gait")
SPEAKABLE = re.compile(r"(?![.\s])[^{}<>\\/]+(?<!\s)")  # Snakemake fills in {x} and <x>
NAMES = (
    "no control characters, braces, angle brackets, slashes or backslashes, no dot or space first and no "
    "space last"
)


def can_be_called(clip: str) -> bool:
    """Whether a clip's name can stand in a path, a line of a log and a wildcard of Snakemake; see NAMES."""
    return clip.isprintable() and SPEAKABLE.fullmatch(clip) is not None


def find_clips(folder: Path) -> dict[str, list[Path]]:
    """Clip -> its BVH files in a folder and those below it, whether they end in .bvh or .BVH, sorted.

    Links are followed, to one folder once however many lead there; hidden folders are left out. Raises
    InputError where a folder cannot be read.
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


def the_file(clip: str, files: list[Path]) -> Path:
    """The only one of a clip's files; raises InputError where there are two, or it is a device or a pipe."""
    if len(files) > 1:
        raise InputError(
            files[1],
            f"a second file of clip {clip}, beside {files[0]}",
            fix="Rename one of them: a clip is called what its file is called, whatever its folder.",
        )
    with contextlib.suppress(OSError):  # a link that leads nowhere is told when the clip is read
        check_regular(files[0])
    return files[0]


def orphan_notes(folder: Path, clips: Collection[str]) -> list[str]:
    """A sentence for each label or status file of a folder, and of those below, that belongs to no clip."""
    out = []
    for here, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(files):
            suffix = next((suffix for suffix in BESIDE if name.endswith(suffix)), None)
            if suffix and (stem := name.removesuffix(suffix)) not in clips:
                near = next(iter(get_close_matches(stem, clips, 1, 0.75)), None)
                asks = f"is it that of {near}? Rename it so" if near else "rename it so, or take it out"
                out.append(f"{Path(here, name)} belongs to no clip and is not read: {asks}.")
    return out
