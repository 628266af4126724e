"""More than a hundred ways to damage a BVH file, or to write the same content differently."""

from __future__ import annotations

import re
from random import Random

from .grammar import NUMBERS, Mutation, numbers, on_line

KEYWORDS = (
    "HIERARCHY",
    "ROOT",
    "JOINT",
    "OFFSET",
    "CHANNELS",
    "End Site",
    "MOTION",
    "Frames:",
    "Frame Time:",
)


def _line(start: str):
    """A random line that begins with `start`, or -1 if there is none."""

    def choose(rng: Random, lines: list[str]) -> int:
        found = [i for i, line in enumerate(lines) if line.strip().startswith(start)]
        return rng.choice(found) if found else -1

    return choose


def _row(rng: Random, lines: list[str]) -> int:
    """A line of the motion, but not the last one."""
    head = [i for i, line in enumerate(lines) if line.strip().startswith("Frame Time:")]
    return rng.randrange(head[0] + 1, len(lines) - 2) if head and head[0] + 4 < len(lines) else -1


def _within(pattern: str, group: int = 1):
    """The place of the group in a random match of a pattern."""

    def find(rng: Random, text: str) -> tuple[int, int]:
        found = list(re.finditer(pattern, text, re.M))
        return rng.choice(found).span(group) if found else (0, 0)

    return find


def _value(rng: Random, text: str) -> tuple[int, int]:
    """One number of the motion."""
    start = max(text.find("\n", text.find("Frame Time:")), 0)
    at = rng.randrange(start, max(len(text) - 1, start + 1))
    while at > start and not text[at - 1].isspace():
        at -= 1
    found = re.compile(r"\S+").search(text, at)
    return found.span() if found else (len(text), len(text))


PLACES = {
    "an offset": (_within(r"^\s*OFFSET \S+ (\S+)"), {"two billion": "any"}),
    "a count of channels": (_within(r"^\s*CHANNELS (\d+)"), dict.fromkeys(NUMBERS, "refused")),
    "the count of frames": (_within(r"^Frames: (\d+)"), dict.fromkeys(NUMBERS, "refused")),
    "the frame time": (_within(r"^Frame Time: (\S+)"), {}),
    "a value": (_value, {"nothing": "refused"}),
}
# Python reads the digits of every script, so a reader may accept them.
EXCEPT = {("a count of channels", "digits of another script"): "any"}


def _edits() -> dict[str, Mutation]:
    out = {}
    for word in KEYWORDS:
        line = _line(word)
        out[f"{word} misspelt"] = on_line(line, lambda s, w=word: s.replace(w, "x" + w[1:], 1)), "refused"
        out[f"{word} missing"] = on_line(line, lambda s: ""), "refused"
        out[f"{word} twice"] = on_line(line, lambda s: f"{s}\n{s}"), "any"
        out[f"{word} in small letters"] = on_line(line, lambda s, w=word: s.replace(w, w.lower(), 1)), "any"
        out[f"{word} with more behind it"] = on_line(line, lambda s: s + " \x7f 7 {"), "any"
    return {name: Mutation(name, change, then) for name, (change, then) in out.items()}


def _bytes_lost(rng: Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + text[at + rng.randint(1, 400) :]


def _flipped(rng: Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + chr(rng.randrange(1, 127)) + text[at + 1 :]


def _rows_of(text: str) -> tuple[str, list[str]]:
    head, _, body = text.partition("Frame Time:")
    first, _, rows = body.partition("\n")
    return f"{head}Frame Time:{first}\n", rows.strip("\n").split("\n")


def _split_rows(rng: Random, text: str) -> str:
    head, rows = _rows_of(text)
    return head + "\n".join(row.replace(" ", "\n", 1) for row in rows) + "\n"


def _one_row(rng: Random, text: str) -> str:
    head, rows = _rows_of(text)
    return head + " ".join(rows) + "\n"


def _few_rows(rng: Random, text: str) -> str:
    head, rows = _rows_of(text)
    return head + "\n".join(rows[: rng.randint(1, len(rows) - 2)]) + "\n"


def _deep(rng: Random, text: str) -> str:
    """Ten thousand joints, each a child of the one before."""
    chain = "".join(f"JOINT j{i}\n{{\nOFFSET 0 1 0\n" for i in range(10_000)) + "}\n" * 10_000
    return text.replace("End Site", chain + "End Site", 1)


def _wide(rng: Random, text: str) -> str:
    """Five thousand children of one joint."""
    joints = "".join(f"JOINT j{i}\n{{\nOFFSET 0 1 0\n}}\n" for i in range(5_000))
    return text.replace("End Site", joints + "End Site", 1)


def _renamed(to: str):
    return lambda rng, text: text.replace("JOINT LeftLeg\n", f"JOINT {to}\n")


WHOLE = {
    "carriage returns": (lambda r, t: t.replace("\n", "\r\n"), "same"),
    "an old Macintosh's lines": (lambda r, t: t.replace("\n", "\r"), "same"),
    "spaces instead of tabs": (lambda r, t: t.replace("\t", "    "), "same"),
    "tabs instead of spaces": (
        lambda r, t: _rows_of(t)[0] + "\n".join(_rows_of(t)[1]).replace(" ", "\t") + "\n",
        "same",
    ),
    "blanks at the ends of lines": (lambda r, t: t.replace("\n", " \t\n"), "same"),
    "a byte order mark": (lambda r, t: "\ufeff" + t, "same"),
    "empty lines at the end": (lambda r, t: t + "\n\n\n", "same"),
    "no line break at the end": (lambda r, t: t.rstrip("\n"), "same"),
    "braces on the joints' lines": (lambda r, t: re.sub(r"\n\s*\{", " {", t), "same"),
    "rows over two lines": (_split_rows, "same"),
    "all rows in one line": (_one_row, "refused"),
    "most rows lost": (_few_rows, "refused"),
    "the last line cut": (lambda r, t: t.rstrip("\n").rsplit(" ", 3)[0], "refused"),
    "cut anywhere": (lambda r, t: t[: r.randrange(len(t) * 9 // 10)], "refused"),
    "nothing in it": (lambda r, t: "", "refused"),
    "blanks only": (lambda r, t: " \n\t\n", "refused"),
    "no motion": (lambda r, t: t[: t.find("MOTION")], "refused"),
    "no hierarchy": (lambda r, t: t[t.find("MOTION") :], "refused"),
    "two files in one": (lambda r, t: t + t, "refused"),
    "zeros in it": (lambda r, t: t[:90] + "\0" * 64 + t[90:], "refused"),
    "an FBX": (lambda r, t: "Kaydara FBX Binary  \x00" + t, "refused"),
    "a page": (lambda r, t: "<!doctype html><title>404</title>", "refused"),
    "bytes lost": (_bytes_lost, "any"),
    "a byte changed": (_flipped, "any"),
    "joints ten thousand deep": (_deep, "refused"),
    "five thousand joints": (_wide, "refused"),
    "a joint of another name": (_renamed("Tail"), "any"),
    "a joint called as a path": (_renamed("../../etc/passwd"), "any"),
    "a joint called <script>": (_renamed("<script>alert(1)</script>"), "any"),
    "a joint without a name": (_renamed(""), "refused"),
    "a joint's name twice": (_renamed("RightLeg"), "refused"),
    "a name of a million letters": (_renamed("x" * 1_000_000), "refused"),
    "a line of a million numbers": (on_line(_row, lambda s: "1 " * 1_000_000), "refused"),
    "a million open braces": (on_line(_line("JOINT"), lambda s: s + "{" * 1_000_000), "refused"),
    "a brace too few": (on_line(_line("}"), lambda s: ""), "refused"),
    "a brace too many": (on_line(_line("}"), lambda s: s + "}"), "refused"),
    "an opening brace too few": (on_line(_line("{"), lambda s: ""), "refused"),
    "an opening brace too many": (on_line(_line("{"), lambda s: s + "{"), "refused"),
    "a second root": (lambda r, t: t.replace("MOTION", "ROOT x\n{\nOFFSET 0 0 0\n}\nMOTION"), "refused"),
    "an unknown channel": (on_line(_line("CHANNELS 3"), lambda s: s.replace("Zrot", "Wrot")), "refused"),
    "a channel twice": (on_line(_line("CHANNELS 3"), lambda s: s.replace("Zrot", "Xrot")), "refused"),
    "a channel less": (on_line(_line("CHANNELS 3"), lambda s: s.replace("3 Zrotation", "2")), "refused"),
    "a channel more": (on_line(_line("CHANNELS 3"), lambda s: s.replace("3 ", "4 Xposition ")), "refused"),
    "an offset of two numbers": (on_line(_line("OFFSET"), lambda s: s.rsplit(" ", 1)[0]), "refused"),
    "an offset of four numbers": (on_line(_line("OFFSET"), lambda s: s + " 1"), "refused"),
    "a row lost": (on_line(_row, lambda s: ""), "any"),
    "a row twice": (on_line(_row, lambda s: f"{s}\n{s}"), "any"),
    "an empty row": (on_line(_row, lambda s: "\n" + s), "same"),
    "a value less in a row": (on_line(_row, lambda s: s.rsplit(" ", 1)[0]), "refused"),
    "a value more in a row": (on_line(_row, lambda s: s + " 1.0"), "refused"),
    "a comment": (on_line(_row, lambda s: "# comment\n" + s), "refused"),
}

MUTATIONS: dict[str, Mutation] = {
    **_edits(),
    **numbers(PLACES, EXCEPT),
    **{name: Mutation(name, change, then) for name, (change, then) in WHOLE.items()},
}
