"""Makes status files from a short table, so that nobody has to type them.

A status file says which links of a clip hurt, and in which frames. A link is the piece of the body between
two neighbouring joints. The table is CSV with the columns clip, link, severity (0 to 10), from, to. `from`
and `to` are frames of the clip's file, counted from 1 and both included. An empty `from` means the first
frame, an empty `to` the last::

    clip,link,severity,from,to
    walk_03,LeftUpLeg-LeftLeg,7,,
    walk_03,LowerBack-Spine,3,400,
"""

import re
from collections.abc import Sequence
from pathlib import Path

from hobble.channels.injury.status import InjurySpell, Status, check_link, parse_severity, write_status
from hobble.core.clip_files import find_clips, require_single_file
from hobble.core.errors import InputError
from hobble.core.files import read_table

WHOLE_NUMBER = re.compile(r"\d{1,12}")
COLUMNS = ("clip", "link", "severity", "from", "to")


def write_statuses(table: str | Path, folder: str | Path, links: Sequence[str]) -> list[Path]:
    """Write a status file `<clip>_injuries.txt` beside each clip in `folder` that the table names.

    links: the names of the links that may hurt. Rows of one clip with the same range of frames become one
    line of its status file. Returns the paths of the status files. Raises InputError, which names the line,
    if the table or a BVH file is wrong; then no file is written.
    """
    in_folder = find_clips(Path(folder))
    files: dict[str, Path] = {}
    frames: dict[str, int] = {}
    # Clip -> (first frame, last frame) -> pairs of link and severity.
    spells: dict[str, dict[tuple[int, int], list[tuple[str, float]]]] = {}
    for line, row in read_table(table, COLUMNS):
        clip, link = row["clip"], row["link"]
        check_link(table, line, link, links)
        severity = parse_severity(table, line, link, row["severity"])
        if clip not in in_folder:
            fix = "Write the name of a BVH file of the folder, without .bvh."
            raise InputError(table, f"no such clip: {clip}", line=line, fix=fix)
        if clip not in files:
            files[clip] = require_single_file(clip, in_folder[clip])
            frames[clip] = bvh_frames(files[clip])
        first, last = _frame(table, line, row["from"]) or 1, _frame(table, line, row["to"]) or frames[clip]
        if not first <= last <= frames[clip]:
            problem = f"the range {first}-{last} does not lie in the {frames[clip]} frames of {clip}"
            raise InputError(table, problem, line=line)
        spells.setdefault(clip, {}).setdefault((first, last), []).append((link, severity))
    written = []
    for clip, of_clip in spells.items():
        written.append(files[clip].with_name(f"{clip}_injuries.txt"))
        lines = tuple(InjurySpell(*span, tuple(pairs)) for span, pairs in of_clip.items())
        write_status(written[-1], Status(frames[clip], lines))
    return written


def bvh_frames(path: Path) -> int:
    """The number of frames in a BVH file's line `Frames:`. Raises InputError if there is no such line."""
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            for line in file:
                key, _, value = line.partition(":")
                if key.strip().lower() == "frames" and WHOLE_NUMBER.fullmatch(value.strip()):
                    return int(value)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from None
    raise InputError(path, "does not say how many frames it has", fix="A BVH file has a line `Frames: 225`.")


def _frame(path: str | Path, line: int, text: str) -> int | None:
    """The frame that a text states; None if it is empty. Raises InputError if it is no frame number."""
    if not text:
        return None
    if not WHOLE_NUMBER.fullmatch(text) or int(text) < 1:
        raise InputError(path, f"{text!r} is not a frame number; frames count from 1", line=line)
    return int(text)
