"""Sentences for the comparison page on which configuration is best at something."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

EQUAL = 0.03  # two values that differ by a smaller share of the lower one are called almost equal


@dataclass(frozen=True)
class Verdict:
    """A sentence about the best configuration.

    at: its place; verdicts are sorted by it. title: what is compared. name: the best configuration. text: the
    sentence.
    """

    at: int
    title: str
    name: str
    text: str


def best(
    at: int,
    title: str,
    values: Mapping[str, float | None],
    say: Callable[[str, float], str],
    more: str = "",
) -> Iterator[Verdict]:
    """The configuration with the lowest value, and the second best; nothing if fewer than two are known.

    say: (name, value) -> words for the sentence. more: another sentence after it, with a leading space.

    >>> [v.text for v in best(1, "Fastest", {"a": 2.0, "b": 3.0}, lambda n, v: f"a frame of {n} takes {v} s")]
    ['A frame of a takes 2.0 s; a frame of b takes 3.0 s.']
    """
    known = sorted((value, name) for name, value in values.items() if value is not None)
    if len(known) < 2:
        return
    (low, first), (second, other) = known[:2]
    equal = "almost equal: " if second <= low * (1 + EQUAL) else ""
    text = f"{say(first, low)}; {equal}{say(other, second)}.{more}"
    yield Verdict(at, title, first, text[0].upper() + text[1:])
