"""Reads BVH files from any program. Errors name the line.

The reader accepts any order of rotations, any channels on any joint, tabs, CRLF, scientific notation, several
end sites on a joint, joint names with spaces or prefixes, and braces anywhere. It returns the numbers as they
are written; `hobble.motion.decode` computes rotations and positions from them.
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

# Limits. One hour at 60 Hz on the largest known rig (191 joints) has 41 million joint poses (frames times
# joints). Their rotations take 1.3 GB of memory.
MOST_BYTES = 1 << 30
MOST_HEADER = 1 << 24  # bytes before the word MOTION
MOST_LINES = 50_000_000  # lines after the word MOTION
LONGEST_LINE = 1 << 22  # bytes; a frame of 4096 joints with six values of 25 characters has 614,400
MOST_JOINT_POSES = 50_000_000  # frames times joints
CUT = "Cut the file into shorter clips."


@dataclass(frozen=True)
class Bvh:
    """A BVH file, with its numbers as they are written.

    path: the file. names, parents: name of each of J joints, and index of its parent (-1 for the root), in
    the file's order.
    offsets: (J, 3) in the file's unit.
    channels: for each joint the names of its channels in the file's order, such as ("Xposition", ...).
    values: (F, C) values of all C channels in F frames. Rotations are in degrees, positions in the file's
    unit.
    frame_time: seconds from frame to frame. frame_time_text: the same, as it is written in the file.
    end_sites: name of a joint -> offsets (x, y, z) of its end sites, in the file's unit.
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

    A file may have one frame more or less than it declares. Raises InputError for a file that is missing,
    empty, binary, truncated or malformed, that has NaN or infinity or a wrong number of values or frames, or
    that declares more frames than it can hold. The error names the line where that is possible.
    """
    path = Path(path)
    raw = read_bytes(path, MOST_BYTES)
    data = _clean_text(path, raw)
    split = _find_motion(path, data)
    header = read_header(path, data[:split])
    bvh = _read_motion(path, data, split, header)
    return replace(bvh, sha256=hashlib.sha256(raw).hexdigest(), bytes=len(raw))


def _clean_text(path: Path, data: bytes) -> bytes:
    """The file's content without a byte order mark, with \\n or \\r\\n at the ends of lines.

    Raises InputError if it is not a BVH text.
    """
    if not data.strip():
        raise InputError(path, "the file is empty", fix=EXPORT)
    if data.startswith(b"Kaydara FBX"):
        raise InputError(path, "this is an FBX file, not BVH", fix="Export the clip as BVH.")
    if b"\0" in data[:65536] or b"\0" in data[-65536:]:
        raise InputError(path, "this is a binary file, not a BVH text file", fix=EXPORT)
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")  # line ends of old Macintosh files
    if not data[:4096].lstrip()[:9].upper() == b"HIERARCHY":
        raise InputError(
            path,
            "this is not a BVH file, because it does not begin with HIERARCHY",
            line=1,
            fix="Export the clip as BVH.",
        )
    return data


_MOTION = re.compile(rb"^[ \t\r}]*MOTION(?![^\s])", re.MULTILINE | re.IGNORECASE)


def _find_motion(path: Path, data: bytes) -> int:
    """The index in `data` of the first word MOTION that begins a line.

    Blanks or closing braces may precede the word.
    """
    found = _MOTION.search(data)
    if not found:
        lines = data.count(b"\n") + 1
        raise InputError(path, "truncated: there is no MOTION section", line=lines, fix=EXPORT)
    if found.end() > MOST_HEADER:
        raise InputError(path, f"MOTION comes after more than {MOST_HEADER >> 20} MB", fix=EXPORT)
    return found.end() - len(b"MOTION")


def _read_motion(path: Path, data: bytes, at: int, header: Header) -> Bvh:
    """The file with its table of values. at: index of the word MOTION in `data`."""
    line = data.count(b"\n", 0, at) + 1
    after = at + len(b"MOTION")
    head = data[after : at + 4096].split(b"\n")
    frames_text, frames_line, frames_end = _declaration(path, head, b"FRAMES:", line)
    time_text, time_line, time_end = _declaration(path, head, b"FRAME TIME:", line)
    body = after + max(frames_end, time_end)
    width = sum(len(c) for c in header.channels)
    try:
        declared = int(frames_text.replace("_", "?"))  # Python would accept 1_000
    except ValueError:
        problem = f"Frames: {frames_text[:40]!r} is not a whole number"
        raise InputError(path, problem, line=frames_line, fix=EXPORT) from None
    try:
        frame_time = float(time_text.replace("_", "?"))
    except ValueError:
        problem = f"Frame Time: {time_text[:40]!r} is not a number"
        raise InputError(path, problem, line=time_line, fix=EXPORT) from None
    if not 1e-4 <= frame_time <= 10:
        problem = f"Frame Time is {time_text[:40]} s; it must be .0001 to 10 s"
        raise InputError(path, problem, line=time_line, fix=EXPORT)
    if declared < 1:
        raise InputError(path, f"declares {declared} frames, but needs one", line=frames_line, fix=EXPORT)
    if not width:
        raise InputError(path, "no joint has a channel", fix=EXPORT)
    # Each value takes at least two bytes: a digit and a blank. One frame may be missing.
    if (declared - 1) * width * 2 > len(data) - body + 2:
        raise InputError(
            path,
            f"truncated: declares {declared} frames of {width} values, more than the file can hold",
            line=frames_line,
            fix=EXPORT,
        )
    if declared * len(header.names) > MOST_JOINT_POSES:
        raise InputError(
            path,
            f"declares {declared} frames of {len(header.names)} joints: more than {MOST_JOINT_POSES} joint "
            "poses (frames times joints)",
            line=frames_line,
            fix=CUT,
        )
    first_line = max(frames_line, time_line) + 1
    values = _read_values(path, data, body, width, declared, first_line)
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
    """Find the line of `head` that begins with `key`.

    Returns the text after `key`, the number of the line in the file, and how many bytes `head` has up to the
    end of this line. head: the lines after the word MOTION. line: number of the first of them in the file.
    """
    end = 0
    for i, raw in enumerate(head[:8]):
        end += len(raw) + 1
        words = b" ".join(raw.split())
        if words.upper().startswith(key):
            return words[len(key) :].strip().decode("latin-1"), line + i, end
    name = "Frames" if key == b"FRAMES:" else "Frame Time"
    raise InputError(path, f"truncated: no {name!r} after MOTION", line=line + 1, fix=EXPORT)


def _read_values(path: Path, data: bytes, at: int, width: int, declared: int, first_line: int) -> Array:
    """The table (F, width) of the numbers in `data` from `at` on.

    Compiled code reads the usual large files, and `np.loadtxt` reads other files with one frame on each line.
    For the rest, `_read_or_explain` reads the table or finds the error. declared: the number of frames that
    the file declares. first_line: number of the line that begins at `at`.
    """
    text = io.BytesIO(data)  # shares the memory of `data`; a slice would be a copy
    text.seek(at)
    if not re.compile(rb"\S").search(data, at):
        raise InputError(path, f"truncated: declares {declared} frames and has none", line=first_line)
    _check_lines(path, data, at, first_line)
    compiled = read_numbers(data, at, width, declared)
    try:
        table = np.loadtxt(text, dtype=float, comments=None, ndmin=2) if compiled is None else compiled
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
        declares = "truncated: declares" if len(table) < declared else "declares"
        raise InputError(path, f"{declares} {declared} frames and has {len(table)}", fix=EXPORT)
    return table


def _check_lines(path: Path, data: bytes, at: int, first_line: int) -> None:
    """Raise InputError if a line is too long or there are too many lines.

    This is checked first, because splitting such a text into lines would take too much memory.
    """
    for start in range(at, len(data) - LONGEST_LINE, LONGEST_LINE):
        if data.find(b"\n", start, start + LONGEST_LINE) < 0:
            line = first_line + data.count(b"\n", at, start)
            problem = f"a line of more than {LONGEST_LINE >> 20} MB"
            raise InputError(path, problem, line=line, fix=EXPORT)
    if data.count(b"\n", at) > MOST_LINES:
        raise InputError(path, f"more than {MOST_LINES} lines after MOTION", fix=CUT)


def _read_or_explain(path: Path, body: bytes, width: int, first_line: int) -> Array:
    """The table (F, width) of a text in which each frame is split over several lines.

    Raises InputError with the line for any other text. body: the text of the table. first_line: the number of
    its first line in the file.
    """
    counts = np.fromiter((len(raw.split()) for raw in io.BytesIO(body)), np.int32)  # values on each line
    filled, total = np.flatnonzero(counts), int(counts.sum(dtype=np.int64))
    # A line with `width` values or more shows that each line should hold one frame.
    if total % width or not total or not (counts[filled] < width).all():
        wrong = np.flatnonzero(counts[filled] != width)
        if len(wrong):
            frame, i = int(wrong[0]), int(filled[wrong[0]])
            last = " (truncated?)" if i == filled[-1] else ""
            problem = f"{counts[i]} values, but the joints have {width} channels{last}"
            raise InputError(path, problem, line=first_line + i, frame=frame + 1, fix=EXPORT)
    for i, raw in enumerate(io.BytesIO(body)):
        for word in raw.split():
            if not _is_number(word):
                shown = word[:40].decode("latin-1")
                comma = " (a decimal comma?)" if b"," in word else ""
                problem = f"{shown!r} is not a number{comma}"
                raise InputError(path, problem, line=first_line + i, fix=EXPORT)
    words = (float(word) for raw in io.BytesIO(body) for word in raw.split())
    return np.fromiter(words, float, total).reshape(-1, width)


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return b"_" not in word  # Python would accept 1_000


def _line_of(body: bytes, frame: int, first_line: int) -> int | None:
    """The number of the line with frame `frame` (from 0), if each line that is not blank holds one frame.

    None if there are fewer such lines. body, first_line: as for `_read_or_explain`.
    """
    filled = (i for i, raw in enumerate(io.BytesIO(body)) if raw.strip())
    index = next(itertools.islice(filled, frame, None), None)
    return None if index is None else first_line + index
