"""Reads, checks and writes status files.

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
from hobble.core.errors import InputError
from hobble.core.files import printable, read_text, write_text
from hobble.core.quat import Array

FPS = 60.0  # frames a second of every clip, whatever the rate of its BVH file
HIGHEST_SEVERITY = 10.0
# A file may have at most this many spells. Three minutes at 120 Hz have about as many frames.
MOST_SPELLS = 20_000
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
    for number, line in enumerate(read_text(path).splitlines(), 1):
        line = line.strip()
        if not line:
            continue
        if frames is None:
            frames = _parse_frame_count(path, number, line)
        elif len(spells) < MOST_SPELLS:
            spells.append(_parse_spell(path, number, line, links))
        else:
            raise InputError(
                path,
                f"has more than {MOST_SPELLS} ranges",
                line=number,
                fix="Join neighbouring ranges with the same severities.",
            )
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


def format_status(status: Status) -> str:
    """The text of a status file. `read_status` turns it back into the same status."""
    lines = [f"frames:{status.frames}"]
    for spell in status.spells:
        hurt = "".join(f"{link}[{severity:g}];" for link, severity in spell.links)
        lines.append(f"{spell.first}-{spell.last} {hurt}")
    return "\n".join(lines) + "\n"


def write_status(path: str | Path, status: Status) -> None:
    """Write a status file. If this fails, no partial file is left behind."""
    write_text(path, format_status(status))


def _parse_frame_count(path: Path, number: int, line: str) -> int:
    """The number of frames in the first line of a status file. number: the line's number, for messages."""
    match = re.fullmatch(r"frames\s*:\s*(\d{1,12})", line, re.IGNORECASE)
    if match is None or int(match[1]) < 1:
        raise InputError(
            path,
            f"{line[:60]!r} is not a frame count",
            line=number,
            fix="For 225 frames, the first line is `frames:225`.",
        )
    return int(match[1])


def _parse_spell(path: Path, number: int, line: str, links: Sequence[str]) -> InjurySpell:
    """The spell in a line of a status file. number: the line's number, for messages."""
    match = SPELL_LINE.fullmatch(line)
    if match is None:
        raise InputError(
            path,
            f"{line[:60]!r} does not read as `first-last Joint-Joint[severity];`",
            line=number,
        )
    first, last = int(match[1]), int(match[2])
    if last < first:
        raise InputError(
            path,
            f"the range {first}-{last} runs backwards",
            line=number,
            fix="Write the smaller frame first.",
        )
    return InjurySpell(first, last, parse_links(match[3], links, path, number), number)


def check_link(path: str | Path, line: int | None, name: str, links: Sequence[str]) -> None:
    """Raise InputError unless `name` is one of `links`. path, line: where it stands, for the message."""
    if name not in links:
        raise InputError(
            path, f"no such link: {printable(name, 80)}", line=line, fix=_similar_links(name, links)
        )


def parse_severity(path: str | Path, line: int | None, link: str, text: str) -> float:
    """The number that `text` states. Raises InputError unless it is from 0 to 10.

    path, line, link: where the text stands and whose severity it is, for the message.
    """
    try:
        value = float(text)
    except ValueError:
        value = -1.0  # refused below
    if not 0 <= value <= HIGHEST_SEVERITY:
        raise InputError(
            path, f"severity {text[:40] or '(empty)'} of {link} is not a number from 0 to 10", line=line
        )
    return value


def _similar_links(name: str, links: Sequence[str]) -> str:
    """Advice on a wrong name: the links with similar names, or all links if none is similar."""
    if not links:
        return "Name a skeleton that can be hurt, such as holden31."
    near = difflib.get_close_matches(name[:200], links)
    return f"Did you mean {' or '.join(near)}?" if near else f"The links are {', '.join(links)}."


def severity_matrix(status: Status, links: Sequence[str]) -> tuple[Array, list[str]]:
    """(status.frames, L) float32 severities, one row for each frame that `status` counts, and warnings.

    links: the names of the columns. Where spells overlap, the one that comes later in `status` counts for the
    links that it names. There is a warning for each range that starts at 0, goes past the last frame or
    contradicts an earlier line. Of many warnings, the first MOST_WARNINGS are returned.
    """
    out = np.zeros((status.frames, len(links)), np.float32)
    line_of = np.zeros(out.shape, np.int32)  # number of the line that set each severity
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
        replaced: dict[int, list[str]] = {}  # number of an earlier line -> links whose severities it loses
        for link, severity in spell.links:
            cells = slice(max(spell.first, 1) - 1, spell.last), column[link]
            if len(warnings) <= MOST_WARNINGS:
                for number in np.unique(line_of[cells][out[cells] != np.float32(severity)]).tolist():
                    replaced.setdefault(number, []).append(link)
            out[cells], line_of[cells] = severity, spell.line or 0
        for number in sorted(replaced.keys() - {0}):
            names = ", ".join(replaced[number])
            warnings.append(
                f"{place} overlaps the range of line {number}. The later line counts for {names}."
            )
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
        raise InputError(
            status_file,
            f"counts {file_status.frames} frames, but {in_source}",
            line=1,
            fix="Write the number of frames of the BVH file, at its own rate, and check the ranges.",
        )
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
