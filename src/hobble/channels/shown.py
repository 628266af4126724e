"""How channels are shown of one figure.

What differs from the usual lies in channels/<name>/shown.py, found by name: its WORDS, `shown`, `sweeps` and
`loops`, each as below. Nothing that trains or measures depends on it.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

from hobble.channels import channel, every
from hobble.core.skeleton import Skeleton


@dataclass(frozen=True)
class Words:
    """rest: the button that tells nothing. step: of a slider. key: what stands before its values in
    the address of
    a page; by default its name. grows: a sentence about a column that is told more and more. never: of
    a column
    that was told nothing in training."""

    rest: str = "Neutral"
    step: float = 0.05
    key: str | None = None
    grows: str = "Walks {} more and more"
    never: str = "never told in training, so telling it would change nothing"


@dataclass(frozen=True)
class Shown:
    """spoken: a name for each column. sliders: their labels -> the column, of those that stand there from the
    beginning. presets: the button of each -> column -> value. regions: for each bone of the body the
    columns, by
    index, that lie in the part which it moves; empty for a channel that lies nowhere, and colours nothing."""

    spoken: Sequence[str]
    sliders: Mapping[str, str]
    presets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    regions: Sequence[Sequence[int]] = ()


@dataclass(frozen=True)
class Loop:
    """A walk to be looked at: what is `told`, column -> value, and whether it is `coloured` in the body."""

    name: str
    told: Mapping[str, float]
    coloured: bool = False


def words(name: str) -> Words:
    """The words of a channel."""
    found = _own(name, "WORDS")
    return found if isinstance(found, Words) else Words()


def shown(name: str, skeleton: Skeleton, columns: Sequence[str], trained: Collection[str]) -> Shown:
    """How a channel is shown; by default with a slider for each column that was told in training."""
    if own := _own(name, "shown"):
        return own(skeleton, columns, trained)
    return Shown(tuple(columns), {column: column for column in columns if column in trained})


def sweeps(
    name: str, skeleton: Skeleton, columns: Sequence[str], trained: Collection[str]
) -> Mapping[str, str]:
    """Walks along which one column is told from 0 to the highest: name -> column; by default all
    trained ones."""
    if own := _own(name, "sweeps"):
        return own(skeleton, columns, trained)
    return {column.replace(" ", "_"): column for column in columns if column in trained}


def loops(name: str, skeleton: Skeleton, columns: Sequence[str], trained: Collection[str]) -> list[Loop]:
    """Walks to be looked at, the first of which is told nothing; by default each trained column at its
    highest."""
    if own := _own(name, "loops"):
        return own(skeleton, columns, trained)
    told, highest = [column for column in columns if column in trained], channel(name).highest
    return [Loop(words(name).rest.lower(), {}), *(Loop(c.replace(" ", "-"), {c: highest}) for c in told)]


def speaker(skeleton: Mapping[str, Any]) -> Callable[[str], str]:
    """A function from a column's label to what a reader calls it; what is no column stays as it is.

    skeleton: as a network's file holds it, empty where that is not known.
    """
    if not skeleton:
        return str
    figure = Skeleton.from_dict({"name": "", **skeleton})
    said: dict[str, str] = {}
    for one in every():
        columns = one.columns(figure)
        said |= dict(zip(columns, shown(one.name, figure, columns, columns).spoken, strict=True))
    return lambda column: said.get(column, column)


def module(name: str) -> ModuleType | None:
    """What a channel says of how it is shown; None where it says nothing."""
    full = f"hobble.channels.{name}.shown"
    return importlib.import_module(full) if importlib.util.find_spec(full) is not None else None


def _own(name: str, what: str) -> Any:
    return getattr(module(name), what, None)
