"""Reads BVH files from any program. Errors name the line.

The reader accepts any order of rotations, any channels on any joint, tabs, CRLF, scientific notation, several
end sites on a joint, joint names with spaces or prefixes, and braces anywhere.
"""

from __future__ import annotations

import hashlib
import io
import itertools
import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from hobble.core import quat
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.untrusted import read_bytes

MOST_JOINTS = 4096  # the largest known rig has 191
LONGEST_NAME = 200  # characters
CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "XYZ")
EXPORT = "Export the clip again."  # advice in most errors


@dataclass
class Header:
    """The joints of a file. `hobble.motion.read.Bvh` explains the fields."""

    names: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[tuple[float, float, float]] = field(default_factory=list)
    channels: list[tuple[str, ...]] = field(default_factory=list)
    end_sites: dict[str, list[tuple[float, float, float]]] = field(default_factory=dict)


class _HeaderParser:
    """Reads the header statement by statement. It needs no recursion, so that hierarchies may be deep.

    line: number of the current line. open: stack of the joints whose braces are open, -1 for an end site.
    pending: the joint (or -1 for an end site) that still needs its opening brace, or None. end_placed:
    whether the last end site has its OFFSET. seen: name of each joint -> number of its line.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.line = 0
        self.header = Header()
        self.open: list[int] = []
        self.pending: int | None = None
        self.end_placed = True
        self.seen: dict[str, int] = {}

    def fail(self, problem: str) -> NoReturn:
        """Raise InputError for the current line."""
        raise InputError(self.path, problem, line=self.line, fix=EXPORT)

    def read_statement(self, text: str) -> None:
        """Read one statement: a keyword and what follows it, or a brace alone."""
        word, _, rest = text.partition(" ")
        handler = {
            "HIERARCHY": self._read_first_line,
            "ROOT": self._read_joint,
            "JOINT": self._read_joint,
            "END": self._read_end_site,
            "{": self._read_opening_brace,
            "}": self._read_closing_brace,
            "OFFSET": self._read_offset,
            "CHANNELS": self._read_channels,
        }.get(word.upper())
        if handler is None:
            self.fail(f"{word[:40]!r} is not known here; expected is a joint, OFFSET, CHANNELS or a brace")
        if self.pending is not None and word != "{":
            self.fail("an opening brace is missing")
        handler(rest.strip())

    def _read_first_line(self, rest: str) -> None:
        if rest:  # the root may follow HIERARCHY on the same line
            self.read_statement(rest)

    def _read_joint(self, name: str) -> None:
        names = self.header.names
        if not name:
            self.fail("a joint without a name")
        if len(name) > LONGEST_NAME:
            self.fail(f"a joint's name has {len(name)} characters, more than {LONGEST_NAME}")
        if name in self.seen:
            self.fail(f"joint {name!r} occurs twice (first in line {self.seen[name]})")
        if names and not self.open:
            self.fail(f"a second root, {name!r}, although a file may have only one figure")
        if len(names) >= MOST_JOINTS:
            self.fail(f"more than {MOST_JOINTS} joints")
        self.seen[name] = self.line
        self.header.parents.append(self.open[-1] if self.open else -1)
        self.pending = len(names)
        names.append(name)
        self.header.offsets.append((np.nan,) * 3)  # until its OFFSET is read
        self.header.channels.append(())

    def _read_end_site(self, rest: str) -> None:
        if not self.open:
            self.fail("an end site outside of any joint")
        self.pending = -1
        self.end_placed = False

    def _read_opening_brace(self, rest: str) -> None:
        if self.pending is None:
            self.fail("an opening brace without a joint")
        self.open.append(self.pending)
        self.pending = None

    def _read_closing_brace(self, rest: str) -> None:
        if not self.open:
            self.fail("a closing brace too many")
        joint = self.open.pop()
        if joint < 0 and not self.end_placed:
            self.fail("an end site has no OFFSET")
        if joint >= 0 and np.isnan(self.header.offsets[joint][0]):
            self.fail(f"joint {self.header.names[joint]!r} has no OFFSET")

    def _read_offset(self, rest: str) -> None:
        if not self.open:
            self.fail("OFFSET outside of any joint")
        try:
            x, y, z = (float(v) for v in rest.replace("_", "?").split())  # Python would accept 1_000
        except ValueError:
            self.fail(f"OFFSET needs three numbers, not {rest[:60]!r}")
        if not np.all(np.isfinite((x, y, z))):
            self.fail(f"OFFSET is not finite: {rest[:60]!r}")
        joint = self.open[-1]
        if joint >= 0:
            self.header.offsets[joint] = (x, y, z)
        else:
            self.end_placed = True
            name = self.header.names[self.open[-2]]
            self.header.end_sites.setdefault(name, []).append((x, y, z))

    def _read_channels(self, rest: str) -> None:
        if not self.open or self.open[-1] < 0:
            self.fail("CHANNELS outside of any joint")
        # Only the beginnings of very long texts are read, because a damaged file may hold anything.
        count, *words = rest.split()[:100] or [""]
        if not count.isdecimal() or int(count[:9]) != len(words):
            self.fail(f"CHANNELS declares {count[:12] or 'no number'} and names {len(words)}")
        known = {name.lower(): name for name in CHANNELS}
        for word in words:
            if word.lower() not in known:
                self.fail(f"unknown channel {word[:40]!r}; known are {', '.join(CHANNELS)}")
        names = tuple(known[word.lower()] for word in words)
        if len(set(names)) < len(names):
            self.fail(f"a channel is named twice: {rest[:100]}")
        self.header.channels[self.open[-1]] = names


def read_header(path: Path, data: bytes) -> Header:
    """The joints of a file. data: the bytes before MOTION. Raises InputError that names the line."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    parser = _HeaderParser(path)
    for parser.line, raw in enumerate(text.split("\n"), 1):  # the loop sets `parser.line`
        # A brace is a statement of its own, wherever it is in the line.
        for part in raw.replace("{", "\n{\n").replace("}", "\n}\n").split("\n"):
            words = " ".join(part.split())
            if words:
                parser.read_statement(words)
    if parser.open or parser.pending is not None:
        parser.fail("truncated: a joint is still open where MOTION begins")
    if not parser.header.names:
        parser.fail("no joints before MOTION")
    return parser.header


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

    `np.loadtxt` reads a file with one frame on each line. For the rest, `_read_or_explain` reads the table or
    finds the error. declared: the number of frames that the file declares. first_line: number of the line
    that begins at `at`.
    """
    text = io.BytesIO(data)  # shares the memory of `data`; a slice would be a copy
    text.seek(at)
    if not re.compile(rb"\S").search(data, at):
        raise InputError(path, f"truncated: declares {declared} frames and has none", line=first_line)
    _check_lines(path, data, at, first_line)
    try:
        table = np.loadtxt(text, dtype=float, comments=None, ndmin=2)
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


# Converts a BVH file's channels to rotations and positions, in the file's own unit and axes.


# Frames a second. Of two rates that fit a file equally well, the one that is listed first is taken.
STANDARD_RATES = (120, 60, 30, 24, 25, 50, 100, 90, 48, 72, 144, 180, 200, 240, 250, 300, 15, 20, 12, 10)

# If all angles of a file are below 2 pi and one of them changes by more than this, they are in radians: as
# degrees they would be too small for a body that moves.
RADIANS = 0.5
BLOCK = 4096  # frames that are converted at a time, to keep intermediate arrays small


@dataclass(frozen=True)
class Decoded:
    """F frames of J joints, in the file's unit.

    rotations: (F, J, 4) quaternions, relative to the parents. root: (F, 3) positions of the root. offsets:
    (J, 3) constant positions relative to the parents. translations: (F, J, 3) positions relative to the
    parents in each frame, or None if no joint but the root moves relative to its parent. repairs: sentences
    on how the position channels of joints other than the root were read. notes: sentences on oddities that
    need no repair.
    """

    rotations: Array = field(repr=False)
    root: Array = field(repr=False)
    offsets: Array = field(repr=False)
    translations: Array | None = field(repr=False)
    repairs: list[str]
    notes: list[str]


def frame_rate(frame_time: float, text: str) -> float:
    """Frames a second for a file's frame time.

    If the frame time can be the rounded frame time of a standard rate, that rate is returned.

    frame_time: seconds. text: the same number as the file writes it, which shows to how many digits it was
    rounded.

    >>> frame_rate(0.008333, "0.008333"), frame_rate(0.0333, "0.0333"), frame_rate(0.016, "0.016")
    (120.0, 30.0, 60.0)
    >>> round(frame_rate(0.0417083, "0.0417083"), 3)
    23.976
    """
    mantissa = text.lower().split("e")[0]
    if "e" not in text.lower() and "." in mantissa:
        last_digit = 10.0 ** -len(mantissa.split(".")[1])  # one unit of the last decimal place
        # Some programs cut digits off instead of rounding. They write .016 for 1/60, which is 4% less.
        rates = [rate for rate in STANDARD_RATES if abs(1 / rate - frame_time) < last_digit * 1.01]
        rates = [rate for rate in rates if abs(rate * frame_time - 1) < 0.045]
        if rates:
            return float(min(rates, key=lambda rate: abs(rate * frame_time - 1)))
    nearest = round(1 / frame_time)
    return float(nearest) if abs(nearest * frame_time - 1) < 1e-5 else 1 / frame_time


def check_angles(bvh: Bvh) -> None:
    """Raise InputError if the angles seem to be in radians, or if no joint has rotation channels."""
    is_rotation = [name.endswith("rotation") for channels in bvh.channels for name in channels]
    if not any(is_rotation):
        fix = "Export the clip with rotations, as nearly all programs do."
        raise InputError(bvh.path, "no joint has rotations, only positions", fix=fix)
    angles = bvh.values[:, is_rotation]
    most = float(np.abs(angles).max())
    if most <= 2 * np.pi and np.ptp(angles, axis=0).max() > RADIANS:
        raise InputError(
            bvh.path,
            f"no angle is larger than {most:.2f}, so they seem to be in radians",
            fix="Export the clip again with angles in degrees.",
        )


def decode_channels(bvh: Bvh, still: float) -> Decoded:
    """Rotations and positions of a BVH file.

    A position channel replaces its component of the joint's OFFSET, as all current programs intend. If the
    position channels of a joint below the root are about zero although its OFFSET is not, their values are
    added to the OFFSET instead. still: a joint whose position stays this close to its offset (in the file's
    unit) does not move relative to its parent.
    """
    frames, joints = len(bvh), len(bvh.names)
    rotations = np.broadcast_to(quat.IDENTITY, (frames, joints, 4)).copy()
    starts = np.cumsum([0, *(len(c) for c in bvh.channels)])  # the first column of each joint's channels
    # Joints with the same channels are converted together, which is faster.
    groups: dict[tuple[str, ...], list[int]] = {}
    for j, channels in enumerate(bvh.channels):
        groups.setdefault(channels, []).append(j)
    for channels, members in groups.items():
        rotation_channels = [i for i, name in enumerate(channels) if name.endswith("rotation")]
        columns = starts[members][:, None] + np.array(rotation_channels, int)
        order = "".join(channels[i][0] for i in rotation_channels)
        for first in range(0, frames if rotation_channels else 0, BLOCK):
            angles = np.radians(bvh.values[first : first + BLOCK, columns])
            rotations[first : first + BLOCK, members] = quat.from_euler(angles, order)
    root, offsets, translations, repairs = _decode_positions(bvh, starts, still)
    notes = _notes_on_wraps(bvh, starts)
    return Decoded(quat.continuous(rotations), root, offsets, translations, repairs, notes)


def _notes_on_wraps(bvh: Bvh, starts: Array) -> list[str]:
    """A sentence on angles that jump by more than half a turn, as they do when they wrap at 360 degrees.

    starts: the first column of each joint's channels. The list is empty if no angle jumps.
    """
    channels = enumerate(bvh.channels)
    rotation_columns = [
        starts[j] + i for j, names in channels for i, name in enumerate(names) if "rot" in name
    ]
    jumps = np.abs(np.diff(bvh.values[:, rotation_columns], axis=0)) > 180.0
    if not jumps.any():
        return []
    frame, column = (int(x) for x in np.argwhere(jumps)[0])
    joint = bvh.names[int(np.searchsorted(starts, rotation_columns[column], side="right")) - 1]
    times = int(jumps.any(axis=1).sum())
    return [
        f"Angles jump by up to a whole turn from one frame to the next, {times} times (first {joint} between "
        f"frames {frame + 1} and {frame + 2}). The rotations themselves are smooth."
    ]


def _decode_positions(bvh: Bvh, starts: Array, still: float) -> tuple[Array, Array, Array | None, list[str]]:
    """The fields `root`, `offsets`, `translations` and `repairs` of `Decoded`.

    starts: the first column of each joint's channels. still: as in `decode_channels`.
    """
    root = np.broadcast_to(bvh.offsets[0], (len(bvh), 3)).copy()
    below_root = []
    for j, channels in enumerate(bvh.channels):
        columns = {name[0]: starts[j] + i for i, name in enumerate(channels) if name.endswith("position")}
        if j == 0:
            for axis, column in columns.items():
                root[:, "XYZ".index(axis)] = bvh.values[:, column]
        elif columns:
            below_root.append((j, columns))
    if not below_root:
        return root, bvh.offsets, None, []
    local = np.broadcast_to(bvh.offsets, (len(bvh), *bvh.offsets.shape)).copy()
    has_channel = np.zeros(bvh.offsets.shape, bool)
    for j, columns in below_root:
        for axis, column in columns.items():
            local[:, j, "XYZ".index(axis)] = bvh.values[:, column]
            has_channel[j, "XYZ".index(axis)] = True
    return root, *_judge_channels(bvh, local, has_channel, still)


def _judge_channels(
    bvh: Bvh, local: Array, has_channel: Array, still: float
) -> tuple[Array, Array | None, list[str]]:
    """Judges which position channels carry motion, which only repeat an offset, and which contradict it.

    Returns the fields `offsets`, `translations` and `repairs` of `Decoded`. local: (F, J, 3) positions
    relative to the parents; where channels must be added to the OFFSETs, this array is changed. has_channel:
    (J, 3) bool, which components of the positions come from channels. still: as in `decode_channels`.
    """
    joints = np.flatnonzero(has_channel.any(axis=1)).tolist()
    median = np.median(local, axis=0)
    added = _joints_to_add(bvh.offsets, median, has_channel, still)
    repairs = []
    if added:
        if np.abs(local[:, joints] * has_channel[joints]).max() <= still:
            dropped = f"The position channels of {len(joints)} joints are zero and were dropped."
            return bvh.offsets, None, [dropped]
        for values in (local, median):
            values[..., added, :] += bvh.offsets[added] * has_channel[added]
        repairs.append(
            f"The position channels of {_list_names(bvh, added)} are about zero, but the OFFSETs are not. "
            "The channels were added to the OFFSETs."
        )
    moving = [j for j in joints if np.abs(local[:, j] - median[j]).max() > still]
    wrong = [j for j in joints if j not in moving and np.abs(median[j] - bvh.offsets[j]).max() > still]
    offsets = bvh.offsets.copy()
    offsets[wrong] = median[wrong]
    if wrong:
        repairs.append(
            f"The OFFSET of {_list_names(bvh, wrong)} contradicts its position channels, which never change. "
            "The values of the channels were used."
        )
    if moving:
        others = "" if len(moving) == len(joints) else ", those of the others do not"
        repairs.append(
            f"{len(joints)} joints below the root have position channels. "
            f"Those of {_list_names(bvh, moving)} change{others}."
        )
    else:
        repairs.append(
            f"The position channels of {len(joints)} joints below the root only repeat their offsets and "
            "were dropped."
        )
    return offsets, (local if moving else None), repairs


def _joints_to_add(offsets: Array, median: Array, has_channel: Array, still: float) -> list[int]:
    """Joints whose position channels are about zero although their offsets are not.

    The channels of such a joint must be added to its offset: if they replaced it, the bone would be far
    shorter than its OFFSET. "About zero" means at most a tenth of the offset's length. This limit is raised
    to `still` if it is less, and lowered to 10 times `still` if it is more.

    median: (J, 3) median, over the frames, of the positions relative to the parents. has_channel: (J, 3)
    bool, which components of the positions come from channels.
    """
    channel_length = np.linalg.norm(median * has_channel, axis=1)
    offset_length = np.linalg.norm(offsets * has_channel, axis=1)
    about_zero = channel_length <= np.clip(0.1 * offset_length, still, 10 * still)
    return np.flatnonzero((offset_length > still) & about_zero).tolist()


def _list_names(bvh: Bvh, joints: list[int]) -> str:
    """The names of the first six joints, with "..." if there are more."""
    return ", ".join(bvh.names[j] for j in joints[:6]) + (", ..." if len(joints) > 6 else "")
