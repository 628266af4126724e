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

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hobble.core.errors import InputError
from hobble.core.files import write_text
from hobble.core.untrusted import read_text

HIGHEST_SEVERITY = 10.0
# A file may have at most this many spells. Three minutes at 120 Hz have about as many frames.
MOST_SPELLS = 20_000
SPELL_LINE = re.compile(r"(\d{1,12})\s*-\s*(\d{1,12})\s+(.*)")  # first frame, last frame, links
LINK_SEVERITY = re.compile(r"\s*(.+?)\s*\[\s*([^\]]*?)\s*\]\s*")  # link, severity


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
        match = LINK_SEVERITY.fullmatch(part)
        if match is None:
            raise InputError(path, f"{part.strip()[:80]!r} does not read as Joint-Joint[severity]", line=line)
        name, value = match[1], match[2]
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
        raise InputError(path, f"no such link: {name[:80]}", line=line, fix=_similar_links(name, links))


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


def _similar_links(name: str, links: Iterable[str]) -> str:
    """Advice on a wrong name: the links with similar names, or all links if none is similar."""
    import difflib

    near = difflib.get_close_matches(name, list(links), 3, 0.6)
    return f"Did you mean {' or '.join(near)}?" if near else f"The links are {', '.join(links)}."
