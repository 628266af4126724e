"""Reads, checks and writes status files, also from a table.

The first line has the number of frames of the clip's BVH file. Each further line is a spell: it says which
links hurt in a range of frames, and how severely, from 0 to 10. A link is the piece of the body between two
neighbouring joints::

    frames:2500
    1-2500 RightUpLeg-RightLeg[10];
    500-2000 LeftShoulder-LeftArm[5];LeftUpLeg-LeftLeg[10];

Frames are those of the BVH file, counted from 1. Both ends of a range are included. A range from 0 is read
as a range from 1. A range that goes past the last frame stops there. Where ranges overlap, the later
line counts for the links that it names.
"""

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.clip import Clip
from hobble.core.clip_files import find_clips, require_single_file
from hobble.core.errors import InputError
from hobble.core.files import printable, read_table, read_text, reading, write_text
from hobble.core.quat import Array

FPS = 60.0  # frames a second of every clip, whatever the rate of its BVH file
HIGHEST_SEVERITY = 10.0
# A file may have at most this many spells. Three minutes at 120 Hz have about as many frames.
MOST_SPELLS = 20_000
FRAME_COUNT = re.compile(r"\s*frames\s*:\s*(\d{1,12})\s*", re.IGNORECASE)
SPELL_LINE = re.compile(r"(\d{1,12})\s*-\s*(\d{1,12})\s+(.*)")  # first frame, last frame, links
MOST_WARNINGS = 100


@dataclass(frozen=True)
class InjurySpell:
    """Links that hurt from frame `first` to frame `last`, counted from 1, both included.

    links: (link, severity) pairs. line: number of the spell's line in its file, from 1; None without a file.
    """

    first: int
    last: int
    links: tuple[tuple[str, float], ...]
    line: int | None = None


@dataclass(frozen=True)
class Status:
    """What hurts in a clip: the content of a status file.

    frames: number of frames of the BVH file. spells: where two overlap, the later one counts for the links
    that it names.
    """

    frames: int
    spells: tuple[InjurySpell, ...] = ()


def read_status(path: str | Path, links: Sequence[str]) -> Status:
    """Read a status file. links: the names of the links that may hurt ("LeftUpLeg-LeftLeg").

    Raises InputError, which names the line, for a grammar error, an unknown link, a severity outside 0 to 10,
    or a range whose last frame comes before its first.
    """
    path = Path(path)
    frames: int | None = None
    spells: list[InjurySpell] = []
    for number, line in enumerate(map(str.strip, read_text(path).splitlines()), 1):
        if line and frames is None:
            match = FRAME_COUNT.fullmatch(line)
            if match is None or int(match[1]) < 1:
                fix = "For 225 frames, the first line is `frames:225`."
                raise InputError(path, f"{line[:60]!r} is not a frame count", line=number, fix=fix)
            frames = int(match[1])
        elif line:
            spells.append(_parse_spell(path, number, line, links))
        if len(spells) > MOST_SPELLS:
            fix = "Join neighbouring ranges with the same severities."
            raise InputError(path, f"has more than {MOST_SPELLS} ranges", line=number, fix=fix)
    if frames is None:
        raise InputError(path, "is empty", fix="Its first line is `frames:` and the number of frames.")
    return Status(frames, tuple(spells))


def parse_links(
    text: str, links: Sequence[str], path: str | Path, line: int | None = None
) -> tuple[tuple[str, float], ...]:
    """The (link, severity) pairs of a text such as `A-B[4];C-D[8];`.

    links: the names of the links that may hurt. path, line: where the text stands, for messages. Raises
    InputError if the text breaks this grammar, names an unknown link or has a severity outside 0 to 10.
    """
    pairs = []
    for part in text.split(";"):
        if not part.strip():
            continue
        name, _, rest = part.partition("[")
        value, closing, after = rest.partition("]")
        name, value = name.strip(), value.strip()
        if not (name and closing) or after.strip():
            raise InputError(path, f"{part.strip()[:80]!r} does not read as Joint-Joint[severity]", line=line)
        check_link(path, line, name, links)
        pairs.append((name, parse_severity(path, line, name, value)))
    if not pairs:
        raise InputError(path, "names no link", line=line, fix="Write Joint-Joint[severity].")
    return tuple(pairs)


def write_status(path: str | Path, status: Status) -> None:
    """Write a status file, which `read_status` reads. If this fails, no partial file is left behind."""
    lines = [f"frames:{status.frames}"]
    for spell in status.spells:
        hurt = "".join(f"{link}[{severity:g}];" for link, severity in spell.links)
        lines.append(f"{spell.first}-{spell.last} {hurt}")
    write_text(path, "\n".join(lines) + "\n")


def _parse_spell(path: Path, number: int, line: str, links: Sequence[str]) -> InjurySpell:
    """The spell in a line of a status file. number: the line's number, for messages."""
    match = SPELL_LINE.fullmatch(line)
    if match is None:
        problem = f"{line[:60]!r} does not read as `first-last Joint-Joint[severity];`"
        raise InputError(path, problem, line=number)
    first, last = int(match[1]), int(match[2])
    if last < first:
        fix = "Write the smaller frame first."
        raise InputError(path, f"the range {first}-{last} runs backwards", line=number, fix=fix)
    return InjurySpell(first, last, parse_links(match[3], links, path, number), number)


def check_link(path: str | Path, line: int | None, name: str, links: Sequence[str]) -> None:
    """Raise InputError unless `name` is one of `links`. path, line: where it stands, for the message."""
    if name not in links:
        near = difflib.get_close_matches(name[:200], links)
        fix = f"Did you mean {' or '.join(near)}?" if near else f"The links are {', '.join(links) or 'none'}."
        raise InputError(path, f"no such link: {printable(name, 80)}", line=line, fix=fix)


def parse_severity(path: str | Path, line: int | None, link: str, text: str) -> float:
    """The number that `text` states. Raises InputError unless it is from 0 to 10.

    path, line, link: where the text stands and whose severity it is, for the message.
    """
    try:
        value = float(text)
    except ValueError:
        value = -1.0  # refused below
    if not 0 <= value <= HIGHEST_SEVERITY:
        problem = f"severity {text[:40] or '(empty)'} of {link} is not a number from 0 to 10"
        raise InputError(path, problem, line=line)
    return value


def severity_matrix(status: Status, links: Sequence[str]) -> tuple[Array, list[str]]:
    """(status.frames, L) float32 severities, one row for each frame that `status` counts, and warnings.

    links: the names of the columns. Where spells overlap, the one that comes later in `status` counts for the
    links that it names. There is a warning for each range that starts at 0 or goes past the last frame. Of
    many warnings, the first MOST_WARNINGS are returned.
    """
    out = np.zeros((status.frames, len(links)), np.float32)
    column = {link: i for i, link in enumerate(links)}
    warnings: list[str] = []
    for spell in status.spells:
        place = f"line {spell.line}: the range {spell.first}-{spell.last}"
        if spell.first > status.frames:
            warnings.append(f"{place} lies past the last frame ({status.frames}) and was ignored.")
        elif spell.last > status.frames:
            warnings.append(f"{place} goes past the last frame ({status.frames}) and was cut there.")
        if spell.first == 0:
            warnings.append(f"{place} starts at 0. Frames count from 1, so it was taken to start at 1.")
        for link, severity in spell.links:
            out[max(spell.first, 1) - 1 : spell.last, column[link]] = severity
    if len(warnings) > MOST_WARNINGS:
        warnings[MOST_WARNINGS:] = ["there are more ranges like these."]
    return out, warnings


def clip_severity(
    clip: Clip, status_file: str | Path | None, status: str | None, motion_report: Mapping[str, Any]
) -> tuple[Array, list[str]]:
    """Severities (F, L) float32 of a clip, and warnings.

    status_file: the file beside the clip's BVH file. status: severities for all frames ("A-B[4];C-D[8]"). If
    it is given, the file is not read. If both are None, all severities are 0. motion_report: how the clip was
    made from its BVH file. It needs the keys that `source_rows` names, `source` (name of the BVH file) and
    `source_frames` (its number of frames).

    Raises InputError if the status or its file cannot be read, or if the first line of the status file
    differs from the number of frames of the BVH file. A difference of one frame is only a warning.
    """
    links = clip.skeleton.link_names
    if not links:  # without links there are no columns, so the status is not read
        return np.zeros((len(clip), 0), np.float32), []
    if status is not None:
        where = f"status of {clip.name} in the data set's configuration"
        whole_clip = InjurySpell(1, len(clip), parse_links(status, links, where))
        return severity_matrix(Status(len(clip), (whole_clip,)), links)
    if status_file is None:
        return np.zeros((len(clip), len(links)), np.float32), []
    file_status = read_status(status_file, links)
    in_source = f"{motion_report['source']} has {motion_report['source_frames']}"
    if abs(file_status.frames - motion_report["source_frames"]) > 1:
        fix = "Write the number of frames of the BVH file, at its own rate, and check the ranges."
        raise InputError(status_file, f"counts {file_status.frames} frames, but {in_source}", line=1, fix=fix)
    rows, warnings = severity_matrix(file_status, links)
    if file_status.frames != motion_report["source_frames"]:
        warnings.insert(
            0,
            f"line 1: counts {file_status.frames} frames, but {in_source}. The ranges were used unchanged. "
            "Check that the status file belongs to this clip.",
        )
    warnings = [f"{Path(status_file).name}, {warning}" for warning in warnings]
    return rows[source_rows(len(clip), file_status.frames, motion_report)], warnings


def source_rows(frames: int, source_frames: int, motion_report: Mapping[str, Any]) -> Array:
    """(frames,) index, from 0, of the frame of the BVH file (the source) that each frame of a clip shows.

    frames: number of frames of the clip. source_frames: number of frames that the status file counts in the
    source. motion_report: how the clip was made from its source.

    Keys of motion_report. source_fps: frames a second of the source. source_start: first frame of the source
    that was used, from 0. cycle_frames: number of frames after which the clip repeats; the length of the clip
    if it does not repeat.
    """
    frame_in_cycle = np.arange(frames) % motion_report.get("cycle_frames", frames)
    source_frame = frame_in_cycle * (motion_report["source_fps"] / FPS) + motion_report.get("source_start", 0)
    # 1e-6 keeps rounding errors from moving a whole number to the frame before it.
    return np.clip(np.floor(source_frame + 1e-6).astype(int), 0, source_frames - 1)


# Makes status files from a short table, so that nobody has to type them.
#
# The table is CSV with the columns clip, link, severity (0 to 10), from, to. `from` and `to` are frames of
# the clip's file, counted from 1 and both included. An empty `from` means the first frame, an empty `to` the
# last:
#
#     clip,link,severity,from,to
#     walk_03,LeftUpLeg-LeftLeg,7,,
#     walk_03,LowerBack-Spine,3,400,


TABLE_COLUMNS = ("clip", "link", "severity", "from", "to")


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
    for line, row in read_table(table, TABLE_COLUMNS):
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
    with reading(path, "cannot be read"), open(path, encoding="utf-8", errors="replace") as file:
        found = next(filter(None, map(FRAME_COUNT.fullmatch, file)), None)
    if found is None:
        fix = "A BVH file has a line `Frames: 225`."
        raise InputError(path, "does not say how many frames it has", fix=fix)
    return int(found[1])


def _frame(path: str | Path, line: int, text: str) -> int | None:
    """The frame that a text states; None if it is empty. Raises InputError if it is no frame number."""
    if not text:
        return None
    if not re.fullmatch(r"\d{1,12}", text) or int(text) < 1:
        raise InputError(path, f"{text!r} is not a frame number; frames count from 1", line=line)
    return int(text)
