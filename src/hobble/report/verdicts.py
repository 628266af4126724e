"""Sentences for the comparison page. Each names the configuration that is best in one respect: a verdict."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

# Two values are called almost equal if the higher one exceeds the lower one by at most this share.
EQUAL = 0.03


@dataclass(frozen=True)
class Verdict:
    """A sentence about the configuration that is best in one respect.

    order: place on the page, which sorts its verdicts by this number. title: heading of the sentence, such as
    "Closest to captured motion". name: the best configuration. text: the sentence.
    """

    order: int
    title: str
    name: str
    text: str


def verdict_on_lowest(
    order: int,
    title: str,
    values: Mapping[str, float | None],
    say: Callable[[str, float], str],
    more: str = "",
) -> Iterator[Verdict]:
    """Yield one verdict: the configuration with the lowest value is best, and is compared with the second.

    Yields nothing if fewer than two configurations have a value. order, title: see `Verdict`. values:
    configuration -> value, or None if it was not measured. say: function (configuration, value) -> half of
    the sentence. more: further text after the sentence; it begins with a space.

    >>> seconds = {"a": 2.0, "b": 3.0}
    >>> found = verdict_on_lowest(1, "Fastest", seconds, lambda name, s: f"a frame of {name} takes {s} s")
    >>> [verdict.text for verdict in found]
    ['A frame of a takes 2.0 s; a frame of b takes 3.0 s.']
    """
    ranked = sorted((value, name) for name, value in values.items() if value is not None)
    if len(ranked) < 2:
        return
    (low, first), (second, other) = ranked[:2]
    equal = "almost equal: " if second <= low * (1 + EQUAL) else ""
    text = f"{say(first, low)}; {equal}{say(other, second)}.{more}"
    yield Verdict(order, title, first, text[0].upper() + text[1:])
