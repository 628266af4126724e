"""What a page says first: figures, and sentences drawn from the numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Figure:
    """A number that a reader should take away, and what it stands beside; at: its place among the others."""

    label: str
    value: str
    unit: str = ""
    beside: str = ""
    at: int = 50


@dataclass(frozen=True)
class Hint:
    """A plain sentence drawn from the numbers.

    kind: "warn", something to mend; "note", something worth doing; "good", what is well; "fact", what asks
    for nothing. at: its place among those of its kind, along the way from clips to the character, since what
    comes first decides what comes later: data below 20, training 20, the network 30, how the character goes
    40, what it is told 50, its speed 60.
    """

    kind: str
    head: str
    text: str
    at: int = 50


def placed(at: int, hints: Iterable[Hint]) -> Iterator[Hint]:
    """The same hints at that place."""
    return (replace(hint, at=at) for hint in hints)
