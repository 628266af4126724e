"""Which of several configurations is best at something, as a sentence for the first screen."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

ALIKE = 0.03  # share of the lower value within which two are as good as each other


@dataclass(frozen=True)
class Verdict:
    """title: what is judged; name: of the best configuration; text: the sentence; at: its place."""

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
    """The configuration of the lowest value, the next one beside it; nothing where fewer than two are known.

    say: one configuration's value in words, to stand in a sentence; it does not begin with the name. more: a
    sentence behind it.

    >>> [v.text for v in best(1, "Fastest", {"a": 2.0, "b": 3.0}, lambda n, v: f"a frame of {n} takes {v} s")]
    ['A frame of a takes 2.0 s; a frame of b takes 3.0 s.']
    """
    known = sorted((value, name) for name, value in values.items() if value is not None)
    if len(known) < 2:
        return
    (low, first), (second, other) = known[:2]
    alike = "as good as level, " if second <= low * (1 + ALIKE) else ""
    text = f"{say(first, low)}; {alike}{say(other, second)}.{more}"
    yield Verdict(at, title, first, text[0].upper() + text[1:])
