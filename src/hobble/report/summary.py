"""What the summary at the top of a page shows: key figures, and advice that follows from the numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace


@dataclass(frozen=True)
class KeyFigure:
    """A number at the top of a page. note: the smaller text under it. order: figures are sorted by it."""

    label: str
    value: str
    unit: str = ""
    note: str = ""
    order: int = 50


@dataclass(frozen=True)
class Hint:
    """Advice that follows from the numbers.

    kind: "warn", a problem; "note", something to improve; "good", something fine; "fact", information. head:
    the first words, in bold. text: the words after them. order: hints of the same kind are sorted by it. It
    grows along the pipeline, because earlier problems cause later ones: data below 20, training 20, network
    30, motion of the character 40, channels 50, speed 60, cost of the pipeline 90.
    """

    kind: str
    head: str
    text: str
    order: int = 50


def with_order(order: int, hints: Iterable[Hint]) -> Iterator[Hint]:
    """The hints, each with this `order` instead of its own."""
    return (replace(hint, order=order) for hint in hints)
