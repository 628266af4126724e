"""Reads BVH files from any program. Errors name the line.

The reader accepts any order of rotations, any channels on any joint, tabs, CRLF, scientific notation, several
end sites on a joint, joint names with spaces or prefixes, and braces anywhere. `read_bvh` returns the numbers
as they are written; `decode_channels` computes rotations and positions, in the file's own unit and axes.
"""

import hashlib
import io
import re
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.files import read_bytes
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton

# Limits. One hour at 60 Hz on the largest known rig (191 joints) has 41 million joint poses (frames times
# joints). Their rotations take 1.3 GB of memory.
MOST_BYTES = 1 << 30
MOST_HEADER = 1 << 24  # bytes before the word MOTION
MOST_JOINTS = 4096
LONGEST_NAME = 200  # characters
LONGEST_LINE = 1 << 22  # bytes, in a file with an error; 4096 joints with six long values have 614,400
MOST_JOINT_POSES = 50_000_000  # frames times joints
CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in "XYZ")
EXPORT = "Export the clip again."  # advice in most errors
# Frames a second. Of two rates that fit a file equally well, the one that is listed first is taken.
STANDARD_RATES = (120, 60, 30, 24, 25, 50, 100, 90, 48, 72, 144, 180, 200, 240, 250, 300, 15, 20, 12, 10)
# If all angles of a file are below 2 pi and one of them changes by more than this, they are in radians: as
# degrees they would be too small for a body that moves.
RADIANS = 0.5
BLOCK = 4096  # frames that are converted at a time, to keep intermediate arrays small


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
    sha256, bytes: hash and size of the file.
    unsure: sentences on what else might have been meant by the file.
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
    sha256: str = ""
    bytes: int = 0
    unsure: tuple[str, ...] = ()

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
    at = _find_motion(path, data)
    joints = _Joints(path, data[:at])
    declared, _, frames_line, frames_end = _declaration(path, data, at, "Frames", int)
    frame_time, time_text, time_line, time_end = _declaration(path, data, at, "Frame Time", float)
    if not 1e-4 <= frame_time <= 10:
        problem = f"Frame Time is {time_text[:40]} s; it must be .0001 to 10 s"
        raise InputError(path, problem, line=time_line, fix=EXPORT)
    at, width = max(frames_end, time_end), sum(map(len, joints.channels))
    _check_size(path, declared, width, len(joints.names), len(data) - at, frames_line)
    return Bvh(
        path,
        tuple(joints.names),
        tuple(joints.parents),
        np.array(joints.offsets, float),
        tuple(joints.channels),
        _read_values(path, data, at, width, declared, max(frames_line, time_line) + 1),
        frame_time,
        time_text,
        joints.end_sites,
        hashlib.sha256(raw).hexdigest(),
        len(raw),
    )


def _clean_text(path: Path, data: bytes) -> bytes:
    """The file's content without a byte order mark, with \\n or \\r\\n at the ends of lines.

    Raises InputError if it is not a BVH text.
    """
    if not data.strip():
        raise InputError(path, "the file is empty", fix=EXPORT)
    refuse_pointer(path, data)
    if data.startswith(b"Kaydara FBX"):
        raise InputError(path, "this is an FBX file, not BVH", fix="Export the clip as BVH.")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff") or data[:2] in (b"H\0", b"\0H"):
        order = "utf-16" if data[:1] in b"\xff\xfe" else "utf-16-le" if data[:1] == b"H" else "utf-16-be"
        data = data.decode(order, "replace").encode()
    if b"\0" in data[:65536] or b"\0" in data[-65536:]:
        raise InputError(path, "this is a binary file, not a BVH text file", fix=EXPORT)
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")  # line ends of old Macintosh files
    if data[:4096].lstrip()[:9].upper() != b"HIERARCHY":
        problem = "this is not a BVH file, because it does not begin with HIERARCHY"
        raise InputError(path, problem, line=1, fix="Export the clip as BVH.")
    return data


def refuse_pointer(path: Path, data: bytes) -> None:
    """Raise InputError for what stands for a file in a repository that was cloned without Git LFS."""
    if data.startswith(b"version https://git-lfs"):
        problem = "this is a pointer of Git LFS, not the file"
        raise InputError(path, problem, fix="Fetch it with `git lfs pull`.")


def _find_motion(path: Path, data: bytes) -> int:
    """The index of the first word MOTION that begins a line, perhaps after blanks or closing braces."""
    found = re.search(rb"^[ \t\r}]*MOTION(?![^\s])", data, re.MULTILINE | re.IGNORECASE)
    if not found:
        lines = data.count(b"\n") + 1
        raise InputError(path, "truncated: there is no MOTION section", line=lines, fix=EXPORT)
    if found.end() > MOST_HEADER:
        raise InputError(path, f"MOTION comes after more than {MOST_HEADER >> 20} MB", fix=EXPORT)
    return found.end() - len(b"MOTION")


class _Joints:
    """The joints of a file, read statement by statement: without recursion, so that hierarchies may be deep.

    names, parents, offsets, channels, end_sites: as in `Bvh`; offsets are empty until they are read. line:
    number of the current line. open: stack of the joints whose braces are open, -1 for an end site. pending:
    the joint, or -1 for an end site, that still needs its opening brace.
    """

    def __init__(self, path: Path, data: bytes) -> None:
        """data: the bytes before MOTION. Raises InputError that names the line."""
        self.path, self.line = path, 0
        self.names: list[str] = []
        self.parents: list[int] = []
        self.offsets: list[tuple[float, ...]] = []
        self.channels: list[tuple[str, ...]] = []
        self.end_sites: dict[str, list[tuple[float, float, float]]] = {}
        self.open: list[int] = []
        self.pending: list[int] = []  # none or one
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
        # The root may follow on the line of the first word, HIERARCHY.
        text = re.sub("HIERARCHY", "", text, count=1, flags=re.IGNORECASE)
        for self.line, raw in enumerate(text.split("\n"), 1):
            # A brace is a statement of its own, wherever it is in the line.
            for part in re.split(r"([{}])", raw):
                if words := part.split():
                    self.read_statement(words[0], words[1:])
        self.need(not self.open and not self.pending, "truncated: a joint is still open where MOTION begins")
        self.need(bool(self.names), "no joints before MOTION")

    def need(self, right: bool, problem: str) -> None:
        """Raise InputError for the current line if something is not right."""
        if not right:
            raise InputError(self.path, problem, line=self.line, fix=EXPORT)

    def read_statement(self, word: str, rest: list[str]) -> None:
        """Read a keyword and what follows it, or a brace alone."""
        keyword = word.upper()
        self.need(not self.pending or word == "{", "an opening brace is missing")
        if keyword in ("ROOT", "JOINT"):
            self.read_joint(" ".join(rest))
        elif keyword == "END":
            self.need(bool(self.open), "an end site outside of any joint")
            self.pending = [-1]
        elif word == "{":
            self.need(bool(self.pending), "an opening brace without a joint")
            self.open.append(self.pending.pop())
        elif word == "}":
            self.need(bool(self.open), "a closing brace too many")
            joint = self.open.pop()
            self.need(joint < 0 or bool(self.offsets[joint]), f"joint {self.names[joint]!r} has no OFFSET")
        elif keyword == "OFFSET":
            self.read_offset(rest)
        elif keyword == "CHANNELS":
            self.read_channels(rest)
        else:
            self.need(False, f"{word[:40]!r} is no joint, OFFSET, CHANNELS or brace")

    def read_joint(self, name: str) -> None:
        """Begin a joint."""
        self.need(bool(name), "a joint without a name")
        self.need(len(name) <= LONGEST_NAME, f"a joint's name has more than {LONGEST_NAME} characters")
        self.need(name not in self.names, f"joint {name!r} occurs twice")
        self.need(bool(self.open) or not self.names, f"a second root, {name!r}: a file has only one figure")
        self.need(len(self.names) < MOST_JOINTS, f"more than {MOST_JOINTS} joints")
        self.pending = [len(self.names)]
        self.names.append(name)
        self.parents.append(self.open[-1] if self.open else -1)
        self.offsets.append(())
        self.channels.append(())

    def read_offset(self, words: list[str]) -> None:
        """Read the OFFSET of a joint or of an end site."""
        self.need(bool(self.open), "OFFSET outside of any joint")
        text = " ".join(words)[:60]
        numbers = len(words) == 3 and all(map(_is_number, words))
        self.need(numbers, f"OFFSET needs three numbers, not {text!r}")
        x, y, z = map(float, words)
        self.need(bool(np.isfinite((x, y, z)).all()), f"OFFSET is not finite: {text!r}")
        if self.open[-1] >= 0:
            self.offsets[self.open[-1]] = (x, y, z)
        else:
            self.end_sites.setdefault(self.names[self.open[-2]], []).append((x, y, z))

    def read_channels(self, words: list[str]) -> None:
        """Read the names of a joint's channels."""
        self.need(bool(self.open) and self.open[-1] >= 0, "CHANNELS outside of any joint")
        # Only the beginnings of very long texts are read, because a damaged file may hold anything.
        count, *names = [word[:40].capitalize() for word in words[:100]] or [""]
        counted = count.isdecimal() and int(count[:9]) == len(names)
        self.need(counted, f"CHANNELS declares {count[:12] or 'no number'} and names {len(names)}")
        unknown = next((name for name in names if name not in CHANNELS), "")
        self.need(not unknown, f"unknown channel {unknown!r}; known are {', '.join(CHANNELS)}")
        self.need(len(set(names)) == len(names), f"a channel is named twice: {' '.join(names)}")
        self.channels[self.open[-1]] = tuple(names)


def _is_number(word: str) -> bool:
    """Whether `float` reads a word. Python would also accept 1_000, which other programs do not write."""
    try:
        float(word)
    except ValueError:
        return False
    return "_" not in word


def _declaration(
    path: Path, data: bytes, at: int, key: str, number: Callable[[str], Any]
) -> tuple[Any, str, int, int]:
    """The value after a key, such as "Frame Time", in one of the lines after MOTION.

    Returns the number, its text, its line, and the index of the next line. at: index of the word MOTION.
    """
    head, line = data[at : at + 4096], data.count(b"\n", 0, at) + 1
    pattern = rf"^[^\S\n]*(?:MOTION\s+)?{key}:([^\n]*)".replace(" ", r"[^\S\n]+")
    found = re.search(pattern.encode(), head, re.IGNORECASE | re.MULTILINE)
    if not found:
        raise InputError(path, f"truncated: no {key!r} after MOTION", line=line + 1, fix=EXPORT)
    line += head.count(b"\n", 0, found.start(1))
    text = found[1].strip().decode("latin-1")
    try:
        return number(text.replace("_", "?")), text, line, at + found.end() + 1
    except ValueError:
        what = "a whole number" if number is int else "a number"
        raise InputError(path, f"{key}: {text[:40]!r} is not {what}", line=line, fix=EXPORT) from None


def _check_size(path: Path, declared: int, width: int, joints: int, left: int, line: int) -> None:
    """Raise InputError if a file declares too many frames, or none.

    declared: frames. width: values in a frame. left: bytes after the declarations. line: of the declaration.
    """
    problem, fix = "", EXPORT
    if declared < 1:
        problem = f"declares {declared} frames, but needs one"
    elif not width:
        problem = "no joint has a channel"
    # Each value takes at least two bytes: a digit and a blank. One frame may be missing.
    elif (declared - 1) * width * 2 > left + 2:
        problem = f"truncated: declares {declared} frames of {width} values, more than the file can hold"
    elif declared * joints > MOST_JOINT_POSES:
        problem = f"declares {declared} frames of {joints} joints: {MOST_JOINT_POSES} poses are the most"
        fix = "Cut the file into shorter clips."
    if problem:
        raise InputError(path, problem, line=line, fix=fix)


def _read_values(path: Path, data: bytes, at: int, width: int, declared: int, first_line: int) -> Array:
    """The table (F, width) of the numbers in `data` from `at` on, however they are divided into lines.

    declared: the number of frames that the file declares. first_line: number of the line that begins at `at`.
    """
    body = data[at:]
    if not body.strip():
        raise InputError(path, f"truncated: declares {declared} frames and has none", line=first_line)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)  # NumPy before 2.4 only warns of other words
            values = np.fromstring(body, sep=" ")  # type: ignore[call-overload]
    except (ValueError, DeprecationWarning):
        values = np.array([np.nan])
    if len(values) % width or not np.isfinite(values).all():
        _explain(path, body, width, first_line)
    frames = len(values) // width
    if abs(frames - declared) > 1:
        declares = "truncated: declares" if frames < declared else "declares"
        raise InputError(path, f"{declares} {declared} frames and has {frames}", fix=EXPORT)
    return values.reshape(frames, width)


def _explain(path: Path, body: bytes, width: int, first_line: int) -> NoReturn:
    """Raise InputError for a table that holds other words than numbers, or a part of a frame.

    body: the text of the table. first_line: the number of its first line in the file.
    """
    counts: list[tuple[int, int]] = []  # (values in a line, number of the line), without empty lines
    for line, raw in enumerate(io.BytesIO(body), first_line):
        if len(raw) > LONGEST_LINE:
            raise InputError(path, f"a line of more than {LONGEST_LINE >> 20} MB", line=line, fix=EXPORT)
        words = raw.decode("latin-1").split()
        for word in words:
            if not _is_number(word) or not np.isfinite(float(word)):
                problem = f"{word[:40]!r} is not a number{' (a decimal comma?)' if ',' in word else ''}"
                problem = "a value is NaN or infinite" if _is_number(word) else problem
                raise InputError(path, problem, line=line, frame=len(counts) + 1, fix=EXPORT)
        if words:
            counts.append((len(words), line))
    # A line with `width` values or more shows that each line should hold one frame.
    frame, (count, line) = next((i, found) for i, found in enumerate(counts, 1) if found[0] != width)
    if all(values < width for values, _ in counts):
        count, line = sum(values for values, _ in counts), counts[-1][1]
    last = " (truncated?)" if line == counts[-1][1] else ""
    problem = f"{count} values, but the joints have {width} channels{last}"
    raise InputError(path, problem, line=line, frame=frame, fix=EXPORT)


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
    if "e" not in text.lower() and "." in text:
        last_digit = 10.0 ** -len(text.split(".")[1])  # one unit of the last decimal place
        # Some programs cut digits off instead of rounding. They write .016 for 1/60, which is 4% less.
        rates = [rate for rate in STANDARD_RATES if abs(1 / rate - frame_time) < last_digit * 1.01]
        rates = [rate for rate in rates if abs(rate * frame_time - 1) < 0.045]
        if rates:
            return float(min(rates, key=lambda rate: abs(rate * frame_time - 1)))
    nearest = round(1 / frame_time)
    return float(nearest) if abs(nearest * frame_time - 1) < 1e-5 else 1 / frame_time


def check_angles(bvh: Bvh) -> None:
    """Raise InputError if the angles seem to be in radians, or if no joint has rotation channels."""
    angles = bvh.values[:, [kind == "rotation" for _, _, kind in _columns(bvh)]]
    if not angles.shape[1]:
        fix = "Export the clip with rotations, as nearly all programs do."
        raise InputError(bvh.path, "no joint has rotations, only positions", fix=fix)
    most = float(np.abs(angles).max())
    if most <= 2 * np.pi and np.ptp(angles, axis=0).max() > RADIANS:
        problem = f"no angle is larger than {most:.2f}, so they seem to be in radians"
        raise InputError(bvh.path, problem, fix="Export the clip again with angles in degrees.")


def _columns(bvh: Bvh) -> list[tuple[int, int, str]]:
    """For each column of `values`: its joint, its axis (0 to 2), and "rotation" or "position"."""
    return [(j, "XYZ".index(name[0]), name[1:]) for j, names in enumerate(bvh.channels) for name in names]


def clean_names(names: Sequence[str]) -> tuple[str, ...]:
    """Joint names without a prefix like "mixamorig:"; unchanged if two names would become equal."""
    short = tuple(name.rpartition(":")[2].strip() for name in names)
    return short if len(set(short)) == len(short) and all(short) else tuple(names)


def decode_channels(bvh: Bvh) -> tuple[Clip, list[str]]:
    """The motion of a BVH file in the file's own unit and axes, at one frame a second.

    Also returns sentences on position channels of joints other than the root that contradict their OFFSETs.
    Names of joints lose their prefixes (see `clean_names`).

    A position channel replaces its component of the joint's OFFSET, as all current programs intend. If the
    position channels of a joint below the root are about zero although its OFFSET is not, their values are
    added to the OFFSET instead. A joint whose position stays within a thousandth of the longest bone of its
    offset does not move relative to its parent.
    """
    rotations = np.broadcast_to(quat.IDENTITY, (len(bvh), len(bvh.names), 4)).copy()
    local = np.broadcast_to(bvh.offsets, (len(bvh), *bvh.offsets.shape)).copy()
    has_channel = np.zeros(bvh.offsets.shape, bool)
    columns: list[list[int]] = [[] for _ in bvh.names]  # the rotation columns of each joint
    for column, (j, axis, kind) in enumerate(_columns(bvh)):
        if kind == "rotation":
            columns[j].append(column)
        else:
            local[:, j, axis], has_channel[j, axis] = bvh.values[:, column], True
    # Joints with the same order of rotations are converted together, which is faster.
    groups: dict[str, list[int]] = {}
    for j, channels in enumerate(bvh.channels):
        groups.setdefault("".join(name[0] for name in channels if "rot" in name), []).append(j)
    for order, members in groups.items():
        own = np.array([columns[j] for j in members], int)
        for first in range(0, len(bvh) if order else 0, BLOCK):
            angles = np.radians(bvh.values[first : first + BLOCK, own])
            rotations[first : first + BLOCK, members] = quat.from_euler(angles, order)
    root = local[:, 0].copy()
    local[:, 0], has_channel[0] = bvh.offsets[0], False
    offsets, translations, repairs = _judge_channels(bvh, local, has_channel)
    names = clean_names(bvh.names)
    ends = {names[bvh.names.index(name)]: sites[0] for name, sites in bvh.end_sites.items()}
    rig = Skeleton(bvh.path.stem, names, bvh.parents, offsets, end_sites=ends)
    clip = Clip(bvh.path.stem, rig, 1.0, quat.continuous(rotations), root, translations)
    return clip, repairs


def _judge_channels(bvh: Bvh, local: Array, has_channel: Array) -> tuple[Array, Array | None, list[str]]:
    """Judges which position channels carry motion, which only repeat an offset, and which contradict it.

    Returns the offsets (J, 3), the positions (F, J, 3) relative to the parents (None if no joint but the root
    moves relative to its parent), and sentences on repairs. local: (F, J, 3) these positions as they are
    written; where channels must be added to the OFFSETs, this array is changed. has_channel: (J, 3) bool,
    which components of the positions come from channels.
    """
    joints = np.flatnonzero(has_channel.any(axis=1)).tolist()
    if not joints:
        return bvh.offsets, None, []
    # A joint whose position stays this close to its offset does not move relative to its parent.
    still = 1e-3 * float(np.linalg.norm(bvh.offsets[1:], axis=-1).max(initial=0.0))
    median = np.median(local, axis=0)
    # The channels of a joint are about zero if they are at most a tenth as long as its OFFSET. If they
    # replaced it, the bone would be far shorter, so they must be added to it.
    channel_length, offset_length = (np.linalg.norm(v * has_channel, axis=1) for v in (median, bvh.offsets))
    about_zero = channel_length <= np.clip(0.1 * offset_length, still, 10 * still)
    added = np.flatnonzero((offset_length > still) & about_zero).tolist()
    for values in (local, median):
        values[..., added, :] += bvh.offsets[added] * has_channel[added]
    moving = [j for j in joints if np.abs(local[:, j] - median[j]).max() > still]
    wrong = [j for j in joints if j not in moving and np.abs(median[j] - bvh.offsets[j]).max() > still]
    offsets, repairs = bvh.offsets.copy(), []
    offsets[wrong] = median[wrong]
    if added:
        zero = f"The position channels of {_list_names(bvh, added)} are about zero"
        repairs.append(f"{zero}, but not the OFFSETs, to which they were added.")
    if wrong:
        contradicts = f"The OFFSET of {_list_names(bvh, wrong)} contradicts its position channels"
        repairs.append(f"{contradicts}, which never change and were used.")
    return offsets, local if moving else None, repairs


def _list_names(bvh: Bvh, joints: list[int]) -> str:
    """The names of the first six joints, with "..." if there are more."""
    return ", ".join(bvh.names[j] for j in joints[:6]) + (", ..." if len(joints) > 6 else "")
