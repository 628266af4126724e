"""Makes status files from a short table, so that nobody has to type them.

A status file says which links of a clip hurt, and in which frames. A link is the piece of the body between
two neighbouring joints. The table is CSV with the columns clip, link, severity (0 to 10), from, to. `from`
and `to` are frames of the clip's file, counted from 1 and both included. An empty `from` means the first
frame, an empty `to` the last::

    clip,link,severity,from,to
    walk_03,LeftUpLeg-LeftLeg,7,,
    walk_03,LowerBack-Spine,3,400,
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from hobble.channels.injury.status import InjurySpell, Status, check_link, parse_severity, write_status
from hobble.core.clip_files import find_clips, require_single_file
from hobble.core.errors import InputError
from hobble.core.untrusted import read_text, read_yaml

WHOLE_NUMBER = re.compile(r"\d{1,12}")
COLUMNS = ("clip", "link", "severity", "from", "to")


@dataclass(frozen=True)
class TableRow:
    """One line of the table.

    first, last: the columns `from` and `to`; None if empty. line: number of the line in the table's file.
    """

    clip: str
    link: str
    severity: float
    first: int | None
    last: int | None
    line: int


def skeleton_links(path: Path) -> list[str]:
    """Names of the links that a skeleton file lists, such as "LeftUpLeg-LeftLeg".

    Raises InputError if the file has no `links`.
    """
    try:
        links = read_yaml(path)["links"]
    except (KeyError, TypeError):
        fix = "Name a skeleton that can be hurt, such as holden31."
        raise InputError(path, "does not list `links`", fix=fix) from None
    return [f"{parent}-{child}" for parent, child in links]


def read_table(path: str | Path, links: Sequence[str]) -> list[TableRow]:
    """Read a table. links: the names of the links that may hurt.

    Raises InputError, which names the line, for bad CSV and for a link, severity or frame that is not valid.
    """
    path = Path(path)
    # newline=None: lines may end in \n, \r\n, or \r as in old Macintosh files.
    lines = io.StringIO(read_text(path), newline=None)
    reader = csv.DictReader(lines, skipinitialspace=True, restkey="more")
    try:
        names = [name.strip() for name in reader.fieldnames or ()]
        if sorted(names) != sorted(COLUMNS):
            shown = f"{', '.join(names) or 'none':.200}"
            raise InputError(path, f"has columns {shown}, not {', '.join(COLUMNS)}", line=1)
        reader.fieldnames = names
        return [_table_row(path, reader.line_num, values, links) for values in reader]
    except csv.Error as error:
        raise InputError(
            path, f"not CSV: {error}", line=reader.reader.line_num, fix="Look for a quotation mark left open."
        ) from None


def status_by_clip(
    rows: Sequence[TableRow], frames: Mapping[str, int], path: str | Path = "the table"
) -> dict[str, Status]:
    """Clip -> its status (what a status file says), for the clips in the rows.

    Rows of one clip with the same range of frames become one spell, which is one line of the status file.
    frames: clip -> number of frames of its file. path: the table's file, for messages. Raises InputError,
    which names the row's line, for a clip that is not in `frames`, and for a range that runs backwards or
    goes past the end of the clip.
    """
    # Clip -> (first frame, last frame) -> pairs of link and severity.
    spells: dict[str, dict[tuple[int, int], list[tuple[str, float]]]] = {}
    for row in rows:
        if row.clip not in frames:
            fix = "Write the name of a BVH file of the folder, without .bvh."
            raise InputError(path, f"no such clip: {row.clip}", line=row.line, fix=fix)
        first, last = row.first or 1, row.last or frames[row.clip]
        if not first <= last <= frames[row.clip]:
            raise InputError(
                path,
                f"the range {first}-{last} does not lie in the {frames[row.clip]} frames of {row.clip}",
                line=row.line,
            )
        spells.setdefault(row.clip, {}).setdefault((first, last), []).append((row.link, row.severity))
    return {
        clip: Status(frames[clip], tuple(InjurySpell(*span, tuple(links)) for span, links in of_clip.items()))
        for clip, of_clip in spells.items()
    }


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


def write_statuses(table: str | Path, folder: str | Path, links: Sequence[str]) -> list[Path]:
    """Write a status file `<clip>_injuries.txt` beside each clip in `folder` that the table names.

    links: the names of the links that may hurt. Returns the paths of the status files. Raises InputError if
    the table or a BVH file is wrong; then no file is written.
    """
    rows = read_table(table, links)
    folder = Path(folder)
    in_folder = find_clips(folder)
    files = {
        row.clip: require_single_file(row.clip, in_folder[row.clip]) for row in rows if row.clip in in_folder
    }
    frames = {clip: bvh_frames(file) for clip, file in files.items()}
    written = []
    for clip, status in status_by_clip(rows, frames, table).items():
        written.append(files[clip].with_name(f"{clip}_injuries.txt"))
        write_status(written[-1], status)
    return written


def _table_row(path: Path, line: int, values: Mapping[str, str | None], links: Sequence[str]) -> TableRow:
    """The row of a line. values: column -> text; None: the line is too short; key "more": it is too long."""
    if "more" in values or None in values.values():
        raise InputError(path, f"the line must have {len(COLUMNS)} values: {', '.join(COLUMNS)}", line=line)
    text = {key: (value or "").strip() for key, value in values.items()}
    check_link(path, line, text["link"], links)
    return TableRow(
        text["clip"],
        text["link"],
        parse_severity(path, line, text["link"], text["severity"]),
        _frame(path, line, text["from"]),
        _frame(path, line, text["to"]),
        line,
    )


def _frame(path: Path, line: int, text: str) -> int | None:
    """The frame that a text states; None if it is empty. Raises InputError if it is no frame number."""
    if not text:
        return None
    if not WHOLE_NUMBER.fullmatch(text) or int(text) < 1:
        raise InputError(path, f"{text!r} is not a frame number; frames count from 1", line=line)
    return int(text)
