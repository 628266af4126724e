"""How channels are shown for a skeleton: words, sliders, presets, sweeps and loops.

A channel is a group of inputs of the network, such as the severities of injuries, with a label for each
column. A sweep is a walk in which one column rises from 0 to its highest value. A loop is a walk for a
looping picture. "Trained" columns are those that were above 0 in training. A channel may have a module
channels/<name>/shown.py with its own WORDS, `shown`, `sweeps` and `loops`. The functions here find these by
name, or return defaults. Neither training nor measurements depend on these modules.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

from hobble.channels import all_channels, channel
from hobble.core.skeleton import Skeleton


@dataclass(frozen=True)
class ChannelWords:
    """Words of a channel on the report page. {} stands for the name of a column.

    rest: label of the button that sets all values to 0. step: step of a slider. key: name of the values in
    the address of the page, by default the channel's name. grows: says that a column rises. never: says that
    a column was 0 in all of training. headline: headline of the page. says: what the network is told when a
    value is above 0. on: a word for a character with a value above 0; if it is empty, the column's name is
    used.
    """

    rest: str = "Neutral"
    step: float = 0.05
    key: str | None = None
    grows: str = "Walks {} more and more"
    never: str = "always 0 in training, so it has no effect"
    headline: str = "Say how it walks."
    says: str = "{}"
    on: str = ""


@dataclass(frozen=True)
class ChannelDisplay:
    """How a channel is shown.

    spoken: a name for each column. sliders: label -> column, for the sliders that are there at the start.
    presets: button -> column -> value. regions: for each bone, the indices of the columns that stand
    for a place on the part of the body that this bone moves; empty if columns stand for no places.
    """

    spoken: Sequence[str]
    sliders: Mapping[str, str]
    presets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    regions: Sequence[Sequence[int]] = ()


@dataclass(frozen=True)
class SampleWalk:
    """A walk for a looping picture. values: column -> value. coloured: whether the values colour the body."""

    name: str
    values: Mapping[str, float]
    coloured: bool = False


def words(name: str) -> ChannelWords:
    """The words of the channel `name`."""
    own_words = _from_module(name, "WORDS")
    return own_words if isinstance(own_words, ChannelWords) else ChannelWords()


def shown(name: str, skeleton: Skeleton, columns: Sequence[str], trained: Collection[str]) -> ChannelDisplay:
    """How the channel `name` is shown. By default there is a slider for each trained column.

    columns: the labels of all columns. trained: the labels of the trained columns.
    """
    if of_channel := _from_module(name, "shown"):
        return of_channel(skeleton, columns, trained)
    return ChannelDisplay(tuple(columns), {column: column for column in columns if column in trained})


def sweeps(
    name: str, skeleton: Skeleton, columns: Sequence[str], trained: Collection[str]
) -> Mapping[str, str]:
    """Name of each sweep -> its column. By default there is one for each trained column."""
    if of_channel := _from_module(name, "sweeps"):
        return of_channel(skeleton, columns, trained)
    return {column.replace(" ", "_"): column for column in columns if column in trained}


def loops(
    name: str, skeleton: Skeleton, columns: Sequence[str], trained: Collection[str]
) -> list[SampleWalk]:
    """Walks for looping pictures.

    By default all values are 0 in the first. Then there is one for each trained column, at its highest value.
    """
    if of_channel := _from_module(name, "loops"):
        return of_channel(skeleton, columns, trained)
    used, highest = [column for column in columns if column in trained], channel(name).highest
    return [
        SampleWalk(words(name).rest.lower(), {}),
        *(SampleWalk(c.replace(" ", "-"), {c: highest}) for c in used),
    ]


def shown_names(skeleton: Mapping[str, Any]) -> Callable[[str], str]:
    """A function that turns a column's label into the name that readers see, and leaves other texts alone.

    skeleton: the entry `skeleton` of a network's file; empty if the file has none.
    """
    if not skeleton:
        return str
    rig = Skeleton.from_dict({"name": "", **skeleton})
    names: dict[str, str] = {}
    for each in all_channels():
        columns = each.columns(rig)
        names |= dict(zip(columns, shown(each.name, rig, columns, columns).spoken, strict=True))
    return lambda column: names.get(column, column)


def module(name: str) -> ModuleType | None:
    """The channel's own module `shown`, or None."""
    full = f"hobble.channels.{name}.shown"
    return importlib.import_module(full) if importlib.util.find_spec(full) is not None else None


def _from_module(name: str, what: str) -> Any:
    """`what` of the channel's own module `shown`, or None if there is no such module or attribute."""
    return getattr(module(name), what, None)
