"""Sentences of the comparison page, each of which names the best configuration in one respect."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

EQUAL = 0.03  # two values are called almost equal if they differ by at most this share of the lower one


@dataclass(frozen=True)
class Verdict:
    """A sentence about the best configuration.

    at: a number; the page shows verdicts in the order of these numbers. title: what is compared. name: the
    best configuration. text: the sentence.
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
    """The verdict on the two configurations with the lowest values; nothing if fewer than two have a value.

    at, title: of the verdict. values: configuration -> value or None. say: (configuration, value) -> half of
    the sentence. more: another sentence after the first one, with a leading space.

    >>> [v.text for v in best(1, "Fastest", {"a": 2.0, "b": 3.0}, lambda n, v: f"a frame of {n} takes {v} s")]
    ['A frame of a takes 2.0 s; a frame of b takes 3.0 s.']
    """
    ranked = sorted((value, name) for name, value in values.items() if value is not None)
    if len(ranked) < 2:
        return
    (low, first), (second, other) = ranked[:2]
    equal = "almost equal: " if second <= low * (1 + EQUAL) else ""
    text = f"{say(first, low)}; {equal}{say(other, second)}.{more}"
    yield Verdict(at, title, first, text[0].upper() + text[1:])
