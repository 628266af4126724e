"""More than a hundred ways to make a status file wrong, or to write the same content differently."""

from __future__ import annotations

import re
from random import Random

from .grammar import Mutation, numbers, on_line

BASE = (
    "frames:300\n"
    "1-300 RightUpLeg-RightLeg[10];\n"
    "50-200 LeftShoulder-LeftArm[5];LeftUpLeg-LeftLeg[2.5];\n"
    "120-260 LeftUpLeg-LeftLeg[7];\n"
)


def _within(pattern: str):
    def find(rng: Random, text: str) -> tuple[int, int]:
        found = list(re.finditer(pattern, text, re.M))
        return rng.choice(found).span(1) if found else (0, 0)

    return find


def _spell(rng: Random, lines: list[str]) -> int:
    found = [i for i, line in enumerate(lines) if "[" in line]
    return rng.choice(found) if found else -1


def _first(rng: Random, lines: list[str]) -> int:
    return 0


NOT_WHOLE = dict.fromkeys(("nothing", "below zero", "a fraction", "an exponent"), "refused")
PLACES = {
    "the count of frames": (_within(r"^frames:(\d+)"), {**NOT_WHOLE, "zero": "refused"}),
    "a first frame": (_within(r"^(\d+)-\d+ "), {**NOT_WHOLE, "two billion": "refused"}),
    "a last frame": (_within(r"^\d+-(\d+) "), {**NOT_WHOLE, "zero": "refused"}),
    "a severity": (
        _within(r"\[([\d.]+)\]"),
        dict.fromkeys(("nothing", "below zero", "two billion", "an exponent"), "refused"),
    ),
}
# float() reads an underscore; the grammar of a severity leaves that to it.
EXCEPT = {("a severity", "an underscore"): "any"}


def _swapped(rng: Random, text: str) -> str:
    lines = text.strip().split("\n")
    return "\n".join([lines[0], *rng.sample(lines[1:], len(lines) - 1)]) + "\n"


LINK = "LeftUpLeg-LeftLeg"
WHOLE = {
    "carriage returns": (lambda r, t: t.replace("\n", "\r\n"), "same"),
    "blanks everywhere": (
        lambda r, t: t.replace("-3", " - 3").replace("[", " [ ").replace("]", " ] "),
        "same",
    ),
    "blanks at the ends of lines": (lambda r, t: t.replace("\n", " \t\n"), "same"),
    "empty lines": (lambda r, t: t.replace("\n", "\n\n"), "same"),
    "a byte order mark": (lambda r, t: "\ufeff" + t, "same"),
    "FRAMES in capitals": (lambda r, t: t.replace("frames:", "FRAMES : "), "same"),
    "no last semicolon": (lambda r, t: t.replace(";\n", "\n"), "same"),
    "semicolons in a row": (lambda r, t: t.replace(";", ";;"), "same"),
    "no line break at the end": (lambda r, t: t.rstrip("\n"), "same"),
    "lines in another order": (_swapped, "any"),
    "nothing in it": (lambda r, t: "", "refused"),
    "blanks only": (lambda r, t: " \n\n", "refused"),
    "only the count": (lambda r, t: t.split("\n")[0], "any"),
    "no count": (lambda r, t: t.split("\n", 1)[1], "refused"),
    "the count twice": (on_line(_first, lambda s: f"{s}\n{s}"), "refused"),
    "the count last": (lambda r, t: "\n".join([*t.strip().split("\n")[1:], t.split("\n")[0]]), "refused"),
    "another word for frames": (lambda r, t: t.replace("frames", "fames"), "refused"),
    "zeros in it": (lambda r, t: t[:30] + "\0\0\0" + t[30:], "refused"),
    "a page": (lambda r, t: "<!doctype html><title>404</title>", "refused"),
    "a pickle": (lambda r, t: "cos\nsystem\n(S'touch pwned'\ntR.", "refused"),
    "a YAML object": (lambda r, t: "!!python/object/apply:os.system ['touch pwned']\n" + t, "refused"),
    "a million lines": (lambda r, t: t + "1-2 LeftUpLeg-LeftLeg[5];\n" * 1_000_000, "refused"),
    "a line of a million letters": (on_line(_spell, lambda s: "x" * 1_000_000), "refused"),
    "a million links": (on_line(_spell, lambda s: s + f"{LINK}[1];" * 20_000), "any"),
    "a link that is none": (lambda r, t: t.replace(LINK, "LeftWing-LeftTip"), "refused"),
    "a link the wrong way round": (lambda r, t: t.replace(LINK, "LeftLeg-LeftUpLeg"), "refused"),
    "a link in small letters": (lambda r, t: t.replace(LINK, LINK.lower()), "refused"),
    "a link called <script>": (lambda r, t: t.replace(LINK, "<script>alert(1)</script>"), "refused"),
    "a link called as a path": (lambda r, t: t.replace(LINK, "../../etc/passwd"), "refused"),
    "a link of one joint": (lambda r, t: t.replace(LINK, "LeftLeg"), "refused"),
    "no link": (on_line(_spell, lambda s: s.split(" ")[0]), "refused"),
    "no severity": (on_line(_spell, lambda s: s.split("[")[0] + ";"), "refused"),
    "a bracket too few": (on_line(_spell, lambda s: s.replace("]", "", 1)), "refused"),
    "an opening bracket too few": (on_line(_spell, lambda s: s.replace("[", "", 1)), "refused"),
    "round brackets": (on_line(_spell, lambda s: s.replace("[", "(").replace("]", ")")), "refused"),
    "a bracket too many": (on_line(_spell, lambda s: s.replace("]", "]]", 1)), "refused"),
    "a comma for a semicolon": (on_line(_spell, lambda s: s.replace(";", ",", 1)), "refused"),
    "no range": (on_line(_spell, lambda s: s.split(" ", 1)[1]), "refused"),
    "half a range": (on_line(_spell, lambda s: s.replace("-", " ", 1)), "refused"),
    "a range backwards": (on_line(_spell, lambda s: "200-100 " + s.split(" ", 1)[1]), "refused"),
    "a range past the end": (on_line(_spell, lambda s: "290-900 " + s.split(" ", 1)[1]), "any"),
    "a range far past the end": (on_line(_spell, lambda s: "1-999999999999 " + s.split(" ", 1)[1]), "any"),
    "a range from 0": (on_line(_spell, lambda s: "0-30 " + s.split(" ", 1)[1]), "any"),
    "a severity past the highest": (on_line(_spell, lambda s: re.sub(r"\[.*?\]", "[10.01]", s)), "refused"),
    "blanks for a severity": (on_line(_spell, lambda s: re.sub(r"\[.*", " " * 6000, s)), "refused"),
    "a range a hundred times": (on_line(_spell, lambda s: f"{s}\n" * 101), "refused"),
    "a comment": (on_line(_spell, lambda s: "# hurts\n" + s), "refused"),
    "cut anywhere": (lambda r, t: t[: r.randrange(len(t))], "any"),
    "a byte changed": (
        lambda r, t: (lambda i: t[:i] + chr(r.randrange(1, 127)) + t[i + 1 :])(r.randrange(len(t))),
        "any",
    ),
}

MUTATIONS: dict[str, Mutation] = {
    **numbers(PLACES, EXCEPT),
    **{name: Mutation(name, change, then) for name, (change, then) in WHOLE.items()},
}
