"""BVH and status files that are damaged or say the same differently, and what reading them must give.

The expected result is "same" (bit for bit that of the file without the mutation), "refused" (a message with
the file and, if a number was replaced, the line), or "any" (a sound result or a refusal).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from random import Random
from typing import NamedTuple

from hypothesis import strategies as st

Change = Callable[[Random, str], str]


class Mutation(NamedTuple):
    """One way to change a file. placed: whether a refusal must name the line."""

    change: Change
    then: str
    placed: bool = False


class Case(NamedTuple):
    """A mutated file: its mutations, and whether it must be refused or read."""

    names: tuple[str, ...]
    text: str
    then: str
    placed: bool


# Replacements for a number that no reader takes as one, and those that it may take.
NO_NUMBERS = {
    "a word": "five", "nan": "nan", "infinity": "-inf", "past the largest float": "1e999",
    "a decimal comma": "1,5", "hexadecimal": "0x10", "two signs": "--1", "an underscore": "1_0",
    "five thousand digits": "9" * 5000, "a control character": "\x01", "markup": "<script>alert(1)</script>",
    "a shell's command": "$(touch${IFS}/tmp/pwned)", "a format": "%s{0}%n",
}  # fmt: skip
NUMBERS = {
    "nothing": "", "zero": "0", "below zero": "-3", "two billion": "2000000000", "a fraction": "0.5",
    "digits of another script": "٣", "an exponent": "1e3",
}  # fmt: skip


def _within(pattern: str) -> Callable[[Random, str], tuple[int, int]]:
    """The place of the group in a random match of a pattern."""

    def find(rng: Random, text: str) -> tuple[int, int]:
        found = list(re.finditer(pattern, text, re.M))
        return rng.choice(found).span(1) if found else (0, 0)

    return find


def _numbers(places: Mapping[str, tuple[str, set[str]]]) -> dict[str, Mutation]:
    """A mutation for every word at every place. A place: its pattern, and which of NUMBERS it refuses."""
    out = {}
    for place, (pattern, refused) in places.items():
        find = _within(pattern)
        for word, text in (NO_NUMBERS | NUMBERS).items():

            def change(rng: Random, whole: str, text: str = text, find=find) -> str:
                start, end = find(rng, whole)
                return whole[:start] + text + whole[end:]

            surely = word in NO_NUMBERS or word in refused
            # float() reads an underscore; the grammar of a severity leaves that to it.
            surely &= (place, word) != ("a severity", "an underscore")
            out[f"{word} as {place}"] = Mutation(change, "refused" if surely else "any", surely)
    return out


def _line(start: str, edit: Callable[[str], str]) -> Change:
    """Edit a random line that has the text `start` in it; an empty result removes the line."""

    def change(rng: Random, text: str) -> str:
        lines = text.split("\n")
        found = [i for i, line in enumerate(lines) if start in line]
        if not found:
            return text
        at = rng.choice(found)
        lines[at : at + 1] = edit(lines[at]).split("\n") if edit(lines[at]) else []
        return "\n".join(lines)

    return change


def _row(edit: Callable[[str], str]) -> Change:
    """Edit a line of the motion, but not the last one."""

    def change(rng: Random, text: str) -> str:
        lines = text.split("\n")
        head = [i for i, line in enumerate(lines) if line.startswith("Frame Time:")]
        if head and head[0] + 4 < len(lines):
            at = rng.randrange(head[0] + 1, len(lines) - 2)
            lines[at : at + 1] = edit(lines[at]).split("\n") if edit(lines[at]) else []
        return "\n".join(lines)

    return change


def _rows(edit: Callable[[list[str]], str]) -> Change:
    """Edit the list of all lines of the motion."""

    def change(rng: Random, text: str) -> str:
        head, _, body = text.partition("Frame Time:")
        first, _, rows = body.partition("\n")
        return f"{head}Frame Time:{first}\n{edit(rows.strip(chr(10)).split(chr(10)))}\n"

    return change


def _joints(count: int, closing: str) -> Change:
    joints = "".join(f"JOINT j{i}\n{{\nOFFSET 0 1 0\n{closing}" for i in range(count))
    return lambda rng, text: text.replace(
        "End Site", joints + ("" if closing else "}\n" * count) + "End Site", 1
    )


def _renamed(to: str) -> Change:
    return lambda rng, text: text.replace("JOINT LeftLeg\n", f"JOINT {to}\n")


def _all(edit: Callable[[str], str]) -> Change:
    return lambda rng, text: edit(text)


def _lost(rng: Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + text[at + rng.randint(1, 400) :]


def _flipped(rng: Random, text: str) -> str:
    at = rng.randrange(len(text))
    return text[:at] + chr(rng.randrange(1, 127)) + text[at + 1 :]


EITHER: dict[str, tuple[Change, str]] = {
    "carriage returns": (_all(lambda t: t.replace("\n", "\r\n")), "same"),
    "blanks at the ends of lines": (_all(lambda t: t.replace("\n", " \t\n")), "same"),
    "a byte order mark": (_all(lambda t: "\ufeff" + t), "same"),
    "no line break at the end": (_all(lambda t: t.rstrip("\n")), "same"),
    "nothing in it": (_all(lambda t: ""), "refused"),
    "blanks only": (_all(lambda t: " \n\t\n"), "refused"),
    "zeros in it": (_all(lambda t: t[:30] + "\0" * 64 + t[30:]), "refused"),
    "a page": (_all(lambda t: "<!doctype html><title>404</title>"), "refused"),
    "a YAML object": (_all(lambda t: "!!python/object/apply:os.system ['touch pwned']\n" + t), "refused"),
    "bytes lost": (_lost, "any"),
    "a byte changed": (_flipped, "any"),
}
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
BVH: dict[str, Mutation] = _numbers(
    {
        "an offset": (r"^\s*OFFSET \S+ (\S+)", {"nothing"}),
        "a count of channels": (r"^\s*CHANNELS (\d+)", set(NUMBERS) - {"digits of another script"}),
        "the count of frames": (r"^Frames: (\d+)", set(NUMBERS)),
        "the frame time": (r"^Frame Time: (\S+)", set()),
        "a value": (r"^[-\d.]+ (?:\S+ ){9}(\S+) ", {"nothing"}),
    }
) | {
    name: Mutation(*what)
    for name, what in {
        **EITHER,
        **{
            f"{w} misspelt": (_line(w, lambda s, w=w: s.replace(w, "x" + w[1:], 1)), "refused")
            for w in KEYWORDS
        },
        **{f"{w} missing": (_line(w, lambda s: ""), "refused") for w in KEYWORDS},
        **{f"{w} twice": (_line(w, lambda s: f"{s}\n{s}"), "any") for w in KEYWORDS},
        **{f"{w} with more": (_line(w, lambda s: s + " \x7f 7 {"), "any") for w in KEYWORDS},
        "an old Macintosh's lines": (_all(lambda t: t.replace("\n", "\r")), "same"),
        "spaces instead of tabs": (_all(lambda t: t.replace("\t", "    ")), "same"),
        "braces on the joints' lines": (_all(lambda t: re.sub(r"\n\s*\{", " {", t)), "same"),
        "rows over two lines": (_rows(lambda rows: "\n".join(r.replace(" ", "\n", 1) for r in rows)), "same"),
        "an empty row": (_row(lambda s: "\n" + s), "same"),
        "all rows in one line": (_rows(" ".join), "same"),
        "most rows lost": (_rows(lambda rows: "\n".join(rows[:9])), "refused"),
        "the last line cut": (_all(lambda t: t.rstrip("\n").rsplit(" ", 3)[0]), "refused"),
        "cut anywhere": (lambda r, t: t[: r.randrange(len(t) * 9 // 10)], "refused"),
        "no motion": (_all(lambda t: t[: t.find("MOTION")]), "refused"),
        "no hierarchy": (_all(lambda t: t[t.find("MOTION") :]), "refused"),
        "two files in one": (_all(lambda t: t + t), "refused"),
        "joints ten thousand deep": (_joints(10_000, ""), "refused"),
        "five thousand joints": (_joints(5_000, "}\n"), "refused"),
        "a joint of another name": (_renamed("Tail"), "any"),
        "a joint called as a path": (_renamed("../../etc/passwd"), "any"),
        "a joint called <script>": (_renamed("<script>alert(1)</script>"), "any"),
        "a joint without a name": (_renamed(""), "refused"),
        "a joint's name twice": (_renamed("RightLeg"), "refused"),
        "a name of a million letters": (_renamed("x" * 1_000_000), "refused"),
        "a line of a million numbers": (_row(lambda s: "1 " * 1_000_000), "refused"),
        "a brace too few": (_line("}", lambda s: ""), "refused"),
        "an opening brace too many": (_line("{", lambda s: s + "{"), "refused"),
        "a second root": (
            _all(lambda t: t.replace("MOTION", "ROOT x\n{\nOFFSET 0 0 0\n}\nMOTION")),
            "refused",
        ),
        "an unknown channel": (_line("CHANNELS 3", lambda s: s.replace("Zrot", "Wrot")), "refused"),
        "a channel twice": (_line("CHANNELS 3", lambda s: s.replace("Zrot", "Xrot")), "refused"),
        "a channel less": (_line("CHANNELS 3", lambda s: s.replace("3 Zrotation", "2")), "refused"),
        "an offset of two numbers": (_line("OFFSET", lambda s: s.rsplit(" ", 1)[0]), "refused"),
        "an offset of four numbers": (_line("OFFSET", lambda s: s + " 1"), "refused"),
        "a row lost": (_row(lambda s: ""), "any"),
        "a value less in a row": (_row(lambda s: s.rsplit(" ", 1)[0]), "refused"),
        "a value more in a row": (_row(lambda s: s + " 1.0"), "refused"),
        "a comment": (_row(lambda s: "# comment\n" + s), "refused"),
    }.items()
}

STATUS_BASE = (
    "frames:300\n1-300 RightUpLeg-RightLeg[10];\n50-200 LeftShoulder-LeftArm[5];LeftUpLeg-LeftLeg[2.5];\n"
    "120-260 LeftUpLeg-LeftLeg[7];\n"
)
LINK = "LeftUpLeg-LeftLeg"


def _spell(edit: Callable[[str], str]) -> Change:
    return _line("[", edit)


def _link(name: str) -> Change:
    return lambda rng, text: text.replace(LINK, name)


NOT_WHOLE = {"nothing", "below zero", "a fraction", "an exponent"}
STATUS: dict[str, Mutation] = _numbers(
    {
        "the count of frames": (r"^frames:(\d+)", NOT_WHOLE | {"zero"}),
        "a first frame": (r"^(\d+)-\d+ ", NOT_WHOLE | {"two billion"}),
        "a last frame": (r"^\d+-(\d+) ", NOT_WHOLE | {"zero"}),
        "a severity": (r"\[([\d.]+)\]", {"nothing", "below zero", "two billion", "an exponent"}),
    }
) | {
    name: Mutation(*what)
    for name, what in {
        **EITHER,
        "blanks everywhere": (_all(lambda t: re.sub(r"(-(?=\d)|\[|\])", r" \1 ", t)), "same"),
        "empty lines": (_all(lambda t: t.replace("\n", "\n\n")), "same"),
        "FRAMES in capitals": (_all(lambda t: t.replace("frames:", "FRAMES : ")), "same"),
        "semicolons in a row": (_all(lambda t: t.replace(";", ";;")), "same"),
        "only the count": (_all(lambda t: t.split("\n")[0]), "any"),
        "no count": (_all(lambda t: t.split("\n", 1)[1]), "refused"),
        "the count twice": (_line("frames", lambda s: f"{s}\n{s}"), "refused"),
        "a million lines": (_all(lambda t: t + f"1-2 {LINK}[5];\n" * 1_000_000), "refused"),
        "a line of a million letters": (_spell(lambda s: "x" * 1_000_000), "refused"),
        "a million links": (_spell(lambda s: s + f"{LINK}[1];" * 20_000), "any"),
        "a link that is none": (_link("LeftWing-LeftTip"), "refused"),
        "a link the wrong way round": (_link("LeftLeg-LeftUpLeg"), "refused"),
        "a link called <script>": (_link("<script>alert(1)</script>"), "refused"),
        "a link called as a path": (_link("../../etc/passwd"), "refused"),
        "no link": (_spell(lambda s: s.split(" ")[0]), "refused"),
        "no severity": (_spell(lambda s: s.split("[")[0] + ";"), "refused"),
        "a bracket too few": (_spell(lambda s: s.replace("]", "", 1)), "refused"),
        "round brackets": (_spell(lambda s: s.replace("[", "(").replace("]", ")")), "refused"),
        "a bracket too many": (_spell(lambda s: s.replace("]", "]]", 1)), "refused"),
        "a comma for a semicolon": (_spell(lambda s: s.replace(";", ",", 1)), "refused"),
        "no range": (_spell(lambda s: s.split(" ", 1)[1]), "refused"),
        "half a range": (_spell(lambda s: s.replace("-", " ", 1)), "refused"),
        "a range backwards": (_spell(lambda s: "200-100 " + s.split(" ", 1)[1]), "refused"),
        "a range past the end": (_spell(lambda s: "290-999999999999 " + s.split(" ", 1)[1]), "any"),
        "a range from 0": (_spell(lambda s: "0-30 " + s.split(" ", 1)[1]), "any"),
        "a severity past the highest": (_spell(lambda s: re.sub(r"\[.*?\]", "[10.01]", s)), "refused"),
        "blanks for a severity": (_spell(lambda s: re.sub(r"\[.*", " " * 6000, s)), "refused"),
        "a range a hundred times": (_spell(lambda s: f"{s}\n" * 101), "refused"),
        "a comment": (_spell(lambda s: "# hurts\n" + s), "refused"),
    }.items()
}


def cases(base: str, table: Mapping[str, Mutation]) -> st.SearchStrategy[Case]:
    """Files with up to three mutations, mostly with one."""

    @st.composite
    def draw_case(draw: st.DrawFn) -> Case:
        some = st.lists(st.sampled_from(sorted(table)), min_size=1, max_size=3, unique=True)
        names = draw(st.one_of(st.sampled_from(sorted(table)).map(lambda n: [n]), some))
        return mutated(base, table, names, draw(st.integers(0, 2**32 - 1)))

    return draw_case()


def mutated(base: str, table: Mapping[str, Mutation], names: list[str], seed: int) -> Case:
    """The file after the mutations of these names."""
    rng, text = Random(seed), base
    for name in names:
        text = table[name].change(rng, text)
    ends = {table[name].then for name in names}
    alone = table[names[0]] if len(names) == 1 else None
    then = "same" if ends == {"same"} or text == base else alone.then if alone else "any"
    return Case(tuple(names), text, then, bool(alone and alone.placed))
