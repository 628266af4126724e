"""Reads BVH files of all kinds. Errors name the line.

The reader accepts any order of rotations, any channels on any joint, tabs, CRLF, scientific notation, several
end sites, joint names with spaces or prefixes, and braces anywhere. Other modules interpret the numbers.
"""

from __future__ import annotations

import hashlib
import io
import itertools
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.untrusted import read_bytes
from hobble.motion.read_header import EXPORT, Header, read_header
from hobble.motion.read_numbers import read_numbers

# Limits. An hour of a rig of 191 joints at 60 Hz is 41 million joint poses, whose rotations take 1.3 GB.
MOST_BYTES = 1 << 30
MOST_HEADER = 1 << 24  # bytes before MOTION
MOST_LINES = 50_000_000  # after MOTION
LONGEST_LINE = 1 << 22  # bytes; a frame of 4096 joints with six values of 25 characters has 614,400
MOST_POSES = 50_000_000  # frames times joints


@dataclass(frozen=True)
class Bvh:
    """A BVH file, with its numbers as they are written.

    path: the file. names, parents: name of each of J joints, and index of its parent (-1 for the root), in
    the file's order.
    offsets: (J, 3) in the file's unit.
    channels: for each joint the names of its channels in the file's order, such as ("Xposition", ...).
    values: (F, C) of F frames and C channels, in degrees and the file's unit.
    frame_time: seconds from frame to frame. frame_time_text: the same, as it is written in the file.
    end_sites: joint -> offsets of its end sites.
    declared: the number of frames that the file declares. F may differ by one (see `read_bvh`).
    sha256, bytes: hash and size of the file.
    """

    path: Path
    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Array = field(repr=False)
    channels: tuple[tuple[str, ...], ...] = field(repr=False)
    values: Array = field(repr=False)
    frame_time: float
    frame_time_text: str
    end_sites: dict[str, list[tuple[float, float, float]]] = field(repr=False)
    declared: int
    sha256: str = ""
    bytes: int = 0

    def __len__(self) -> int:
        return len(self.values)


def read_bvh(path: str | Path) -> Bvh:
    """Read a BVH file.

    A file may have one frame more or less than it declares. Raises InputError, with the line if there is one,
    for a file that is missing, empty, binary, truncated or malformed, that has NaN or infinity or a wrong
    number of values or frames, or that declares more frames than it can hold.
    """
    path = Path(path)
    raw = read_bytes(path, MOST_BYTES)
    data = _text(path, raw)
    split = _motion_at(path, data)
    header = read_header(path, data[:split])
    bvh = _motion(path, data, split, header)
    return replace(bvh, sha256=hashlib.sha256(raw).hexdigest(), bytes=len(raw))


def _text(path: Path, data: bytes) -> bytes:
    if not data.strip():
        raise InputError(path, "the file is empty", fix=EXPORT)
    if data.startswith(b"Kaydara FBX"):
        raise InputError(path, "this is an FBX file, not BVH", fix="Export the clip as BVH.")
    if b"\0" in data[:65536] or b"\0" in data[-65536:]:
        raise InputError(path, "binary data, not a BVH text file", fix=EXPORT)
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")  # line ends of old Macintosh files
    if not data[:4096].lstrip()[:9].upper() == b"HIERARCHY":
        raise InputError(path, "not a BVH file: it does not begin with HIERARCHY", line=1)
    return data


_MOTION = re.compile(rb"^[ \t\r}]*MOTION(?![^\s])", re.MULTILINE | re.IGNORECASE)


def _motion_at(path: Path, data: bytes) -> int:
    """The index of the first word MOTION at the start of a line, after blanks or closing braces if any."""
    found = _MOTION.search(data)
    if not found:
        lines = data.count(b"\n") + 1
        raise InputError(path, "truncated: there is no MOTION section", line=lines, fix=EXPORT)
    if found.end() > MOST_HEADER:
        raise InputError(path, f"MOTION comes after more than {MOST_HEADER >> 20} MB", fix=EXPORT)
    return found.end() - len(b"MOTION")


def _motion(path: Path, data: bytes, at: int, header: Header) -> Bvh:
    line = data.count(b"\n", 0, at) + 1
    head = data[at + 6 : at + 4096].split(b"\n")
    frames_text, line_frames, at_frames = _declaration(path, head, b"FRAMES:", line)
    time_text, line_time, at_time = _declaration(path, head, b"FRAME TIME:", line)
    body = at + 6 + max(at_frames, at_time)
    width = sum(len(c) for c in header.channels)
    try:
        declared = int(frames_text.replace("_", "?"))  # Python would accept 1_000
    except ValueError:
        raise InputError(path, f"Frames: {frames_text[:40]!r} is not a number", line=line_frames) from None
    try:
        frame_time = float(time_text.replace("_", "?"))
    except ValueError:
        raise InputError(path, f"Frame Time: {time_text[:40]!r} is not a number", line=line_time) from None
    if not 1e-4 <= frame_time <= 10:
        raise InputError(path, f"Frame Time {time_text[:40]} s makes no sense", line=line_time, fix=EXPORT)
    if declared < 1:
        raise InputError(path, f"declares {declared} frames", line=line_frames, fix=EXPORT)
    if not width:
        raise InputError(path, "no joint has a channel", fix=EXPORT)
    if (declared - 1) * width * 2 > len(data) - body + 2:
        raise InputError(
            path,
            f"truncated: declares {declared} frames of {width} values, more than the file can hold",
            line=line_frames,
            fix=EXPORT,
        )
    if declared * len(header.names) > MOST_POSES:
        raise InputError(
            path,
            f"declares {declared} frames of {len(header.names)} joints: more than {MOST_POSES} joint "
            "poses (frames times joints)",
            line=line_frames,
            fix="Cut it into shorter clips.",
        )
    first = max(line_frames, line_time) + 1
    values = _values(path, data, body, width, declared, first)
    return Bvh(
        path,
        tuple(header.names),
        tuple(header.parents),
        np.array(header.offsets, float),
        tuple(header.channels),
        values,
        frame_time,
        time_text,
        header.end_sites,
        declared,
    )


def _declaration(path: Path, head: list[bytes], key: bytes, line: int) -> tuple[str, int, int]:
    """The text after `key` in the lines `head`, the number of its line, and where in `head` that line ends.

    line: number of the first line of `head`.
    """
    end = 0
    for i, raw in enumerate(head[:8]):
        end += len(raw) + 1
        words = b" ".join(raw.split())
        if words.upper().startswith(key):
            return words[len(key) :].strip().decode("latin-1"), line + i, end
    name = "Frames" if key == b"FRAMES:" else "Frame Time"
    raise InputError(path, f"truncated: no {name!r} after MOTION", line=line + 1, fix=EXPORT)


def _values(path: Path, data: bytes, at: int, width: int, declared: int, first_line: int) -> Array:
    """The table (F, width) of the numbers in `data` from `at` on.

    If a line does not hold exactly one frame, a slower reader reads the table or finds the error.
    """
    text = io.BytesIO(data)  # shares the bytes; a slice would copy them
    text.seek(at)
    if not re.compile(rb"\S").search(data, at):
        raise InputError(path, f"truncated: declares {declared} frames and has none", line=first_line)
    _check_lines(path, data, at, first_line)
    quick = read_numbers(data, at, width, declared)
    try:
        table = np.loadtxt(text, dtype=float, comments=None, ndmin=2) if quick is None else quick
    except ValueError:
        table = _read_or_explain(path, data[at:], width, first_line)
    if table.shape[1] != width:
        table = _read_or_explain(path, data[at:], width, first_line)
    bad = ~np.isfinite(table).all(axis=1)
    if bad.any():
        frame = int(np.argmax(bad))
        line = _line_of(data[at:], frame, first_line)
        raise InputError(path, "a value is NaN or infinite", line=line, frame=frame + 1, fix=EXPORT)
    if abs(len(table) - declared) > 1:
        what = "truncated: declares" if len(table) < declared else "declares"
        raise InputError(path, f"{what} {declared} frames and has {len(table)}", fix=EXPORT)
    return table


def _check_lines(path: Path, data: bytes, at: int, first_line: int) -> None:
    """Raise InputError if a line is too long or there are too many lines, before splitting takes memory."""
    for start in range(at, len(data) - LONGEST_LINE, LONGEST_LINE):
        if data.find(b"\n", start, start + LONGEST_LINE) < 0:
            line = first_line + data.count(b"\n", at, start)
            problem = f"a line of more than {LONGEST_LINE >> 20} MB"
            raise InputError(path, problem, line=line, fix=EXPORT)
    if data.count(b"\n", at) > MOST_LINES:
        raise InputError(path, f"more than {MOST_LINES} lines after MOTION", fix="Cut it into shorter clips.")


def _read_or_explain(path: Path, body: bytes, width: int, first_line: int) -> Array:
    """Read frames that are split over several lines. Anything else raises InputError with the line."""
    counts = np.fromiter((len(raw.split()) for raw in io.BytesIO(body)), np.int32)
    used, total = np.flatnonzero(counts), int(counts.sum(dtype=np.int64))
    if total % width or not total or not (counts[used] < width).all():
        wrong = np.flatnonzero(counts[used] != width)
        if len(wrong):
            n, i = int(wrong[0]), int(used[wrong[0]])
            last = " (truncated?)" if i == used[-1] else ""
            problem = f"{counts[i]} values, but the joints have {width} channels{last}"
            raise InputError(path, problem, line=first_line + i, frame=n + 1, fix=EXPORT)
    for i, raw in enumerate(io.BytesIO(body)):
        for word in raw.split():
            if not _number(word):
                shown = word[:40].decode("latin-1")
                comma = " (a decimal comma?)" if b"," in word else ""
                problem = f"{shown!r} is not a number{comma}"
                raise InputError(path, problem, line=first_line + i, fix=EXPORT)
    words = (float(word) for raw in io.BytesIO(body) for word in raw.split())
    return np.fromiter(words, float, total).reshape(-1, width)


def _number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return b"_" not in word


def _line_of(body: bytes, frame: int, first_line: int) -> int | None:
    used = (i for i, raw in enumerate(io.BytesIO(body)) if raw.strip())
    at = next(itertools.islice(used, frame, None), None)
    return None if at is None else first_line + at
