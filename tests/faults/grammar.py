"""Mutations of a text: what can be wrong with a file, and the expected result of reading it.

The expected result is "same" (bit for bit that of the file without the mutation), "refused" (a message with
the file and, if `placed`, the line), or "any" (the mutated file may be valid: a sound result or a refusal).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from random import Random

from hypothesis import strategies as st

Find = Callable[[Random, str], tuple[int, int]]
Change = Callable[[Random, str], str]

# Replacements for a number, and the expected result of each.
NUMBERS: dict[str, tuple[str, str]] = {
    "a word": ("five", "refused"),
    "nan": ("nan", "refused"),
    "infinity": ("-inf", "refused"),
    "past the largest float": ("1e999", "refused"),
    "a decimal comma": ("1,5", "refused"),
    "hexadecimal": ("0x10", "refused"),
    "two points": ("1.2.3", "refused"),
    "two signs": ("--1", "refused"),
    "an underscore": ("1_0", "refused"),
    "five thousand digits": ("9" * 5000, "refused"),
    "a superscript": ("²", "refused"),
    "a control character": ("\x01", "refused"),
    "markup": ("<script>alert(1)</script>", "refused"),
    "a shell's command": ("$(touch${IFS}/tmp/pwned)", "refused"),
    "a format": ("%s{0}%n", "refused"),
    "nothing": ("", "any"),
    "zero": ("0", "any"),
    "below zero": ("-3", "any"),
    "two billion": ("2000000000", "any"),
    "a fraction": ("0.5", "any"),
    "digits of another script": ("٣", "any"),
    "an exponent": ("1e3", "any"),
}


@dataclass(frozen=True)
class Mutation:
    """One way to change a file."""

    name: str
    change: Change
    then: str = "any"
    placed: bool = False


@dataclass(frozen=True)
class Case:
    """A mutated file: its mutations, and whether it must be refused or read."""

    names: tuple[str, ...]
    text: str
    then: str
    placed: bool


def number_at(find: Find, word: str) -> Change:
    """Put `word` at a place of a number, which `find` finds."""

    def change(rng: Random, text: str) -> str:
        start, end = find(rng, text)
        return text[:start] + word + text[end:]

    return change


def numbers(
    places: Mapping[str, tuple[Find, Mapping[str, str]]], exceptions: Mapping[tuple[str, str], str]
) -> dict[str, Mutation]:
    """A mutation for every word of NUMBERS at every place. A place, or a place and a word, may expect
    something else than usual.
    """
    out = {}
    for place, (find, special) in places.items():
        for word, (text, usual) in NUMBERS.items():
            then = exceptions.get((place, word)) or special.get(word) or usual
            name = f"{word} as {place}"
            out[name] = Mutation(name, number_at(find, text), then, placed=then == "refused")
    return out


def on_line(choose: Callable[[Random, list[str]], int], edit: Callable[[str], str]) -> Change:
    """A mutation that edits one line; an empty result removes the line."""

    def change(rng: Random, text: str) -> str:
        lines = text.split("\n")
        at = choose(rng, lines)
        if at < 0:
            return text
        lines[at : at + 1] = edit(lines[at]).split("\n") if edit(lines[at]) else []
        return "\n".join(lines)

    return change


def cases(base: str, table: Mapping[str, Mutation]) -> st.SearchStrategy[Case]:
    """Files with one mutation, or with up to three at once."""

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
