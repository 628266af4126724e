"""Reads the header of a BVH file: its joints, their offsets and channels."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

import numpy as np

from hobble.core.errors import InputError

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
