"""Reads, checks and writes status files.

The first line has the number of frames of the clip's file. Each further line says which links hurt in a range
of frames, and how severely, from 0 to 10. A link is the piece of the body between two neighbouring joints::

    frames:2500
    1-2500 RightUpLeg-RightLeg[10];
    500-2000 LeftShoulder-LeftArm[5];LeftUpLeg-LeftLeg[10];

Frames are those of the clip's file, counted from 1, and both ends of a range are included. A range that is
written from 0 starts at 1. A range that goes past the end of the clip stops there. Where ranges overlap, the
later line counts for the links that it names.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from hobble.core.errors import InputError
from hobble.core.files import write_text
from hobble.core.untrusted import read_text

HIGHEST = 10.0  # the highest severity
# A file may have at most this many ranges: about one for each frame of three minutes at 120 Hz.
MOST_SPELLS = 20_000
RANGE = re.compile(r"(\d{1,12})\s*-\s*(\d{1,12})\s+(.*)")  # first frame, last frame, links
LINK = re.compile(r"\s*(.+?)\s*\[\s*([^\]]*?)\s*\]\s*")  # name, severity


@dataclass(frozen=True)
class InjurySpell:
    """Links that hurt from frame `first` to frame `last`, counted from 1, both included.

    links: (link, severity) pairs. line: the spell's line in the file, if it comes from a file.
    """

    first: int
    last: int
    links: tuple[tuple[str, float], ...]
    line: int | None = None


@dataclass(frozen=True)
class Status:
    """What hurts in a clip.

    frames: number of frames of the clip's file. spells: where some overlap, the last one counts for the links
    that it names.
    """

    frames: int
    spells: tuple[InjurySpell, ...] = ()


def read_status(path: str | Path, links: Sequence[str]) -> Status:
    """Read a status file. links: the names of the links that may hurt ("LeftUpLeg-LeftLeg").

    Raises InputError with the line for a grammar error, an unknown link, a severity outside 0..10, or a range
    that runs backwards.
    """
    path = Path(path)
    frames: int | None = None
    spells: list[InjurySpell] = []
    for number, line in enumerate(read_text(path).splitlines(), 1):
        line = line.strip()
        if not line:
            continue
        if frames is None:
            frames = _frame_count(path, number, line)
        elif len(spells) < MOST_SPELLS:
            spells.append(_spell(path, number, line, links))
        else:
            raise InputError(path, f"more than {MOST_SPELLS} ranges", line=number)
    if frames is None:
        raise InputError(path, "is empty", fix="Its first line is `frames:` and the number of frames.")
    return Status(frames, tuple(spells))


def parse_links(
    text: str, links: Sequence[str], path: str | Path, line: int | None = None
) -> tuple[tuple[str, float], ...]:
    """The (link, severity) pairs of `A-B[4];C-D[8];`, as in status files and in a data set's entries.

    links: the names of the links that may hurt. path, line: where the text stands, for messages. Raises
    InputError if the text breaks this grammar or names an unknown link.
    """
    pairs = []
    for part in text.split(";"):
        if not part.strip():
            continue
        match = LINK.fullmatch(part)
        if match is None:
            raise InputError(path, f"{part.strip()[:80]!r} does not read as Joint-Joint[severity]", line=line)
        name, value = match[1], match[2]
        check_link(path, line, name, links)
        pairs.append((name, check_severity(path, line, name, value)))
    if not pairs:
        raise InputError(path, "names no link", line=line, fix="Write Joint-Joint[severity];")
    return tuple(pairs)


def format_status(status: Status) -> str:
    """The text of a status file; `read_status` gives back the same status."""
    lines = [f"frames:{status.frames}"]
    for spell in status.spells:
        hurt = "".join(f"{link}[{severity:g}];" for link, severity in spell.links)
        lines.append(f"{spell.first}-{spell.last} {hurt}")
    return "\n".join(lines) + "\n"


def write_status(path: str | Path, status: Status) -> None:
    """Write a status file. No partial file is left behind if this fails."""
    write_text(path, format_status(status))


def _frame_count(path: Path, number: int, line: str) -> int:
    match = re.fullmatch(r"frames\s*:\s*(\d{1,12})", line, re.IGNORECASE)
    if match is None or int(match[1]) < 1:
        raise InputError(
            path, f"{line[:60]!r} is not a frame count", line=number, fix="The first line reads `frames:225`."
        )
    return int(match[1])


def _spell(path: Path, number: int, line: str, links: Sequence[str]) -> InjurySpell:
    match = RANGE.fullmatch(line)
    if match is None:
        raise InputError(
            path,
            f"{line[:60]!r} does not read as `first-last Joint-Joint[severity];`",
            line=number,
        )
    first, last = int(match[1]), int(match[2])
    if last < first:
        raise InputError(path, f"the range {first}-{last} runs backwards", line=number)
    return InjurySpell(first, last, parse_links(match[3], links, path, number), number)


def check_link(path: str | Path, line: int | None, name: str, links: Sequence[str]) -> None:
    """Raise InputError unless `name` is one of `links`. path, line: where the name stands."""
    if name not in links:
        raise InputError(path, f"no such link: {name[:80]}", line=line, fix=_hint(name, links))


def check_severity(path: str | Path, line: int | None, link: str, text: str) -> float:
    """The severity of a link, from its text. Raises InputError unless it is a number from 0 to 10.

    path, line: where the text stands.
    """
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0 <= value <= HIGHEST:
        raise InputError(path, f"severity {text[:40] or 'nothing'} of {link} is not in 0..10", line=line)
    return value


def _hint(name: str, links: Iterable[str]) -> str:
    import difflib

    near = difflib.get_close_matches(name, list(links), 3, 0.6)
    return f"Did you mean {' or '.join(near)}?" if near else f"There are {', '.join(links)}."
