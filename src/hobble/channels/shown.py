"""How a channel is shown on the report page and in pictures: words, sliders, presets, sweeps and loops.

A channel is a group of inputs of the network, such as the severities of injuries. Each input is a column with
a label. "Trained" columns are those that were above 0 in training. A preset is a button that sets several
columns. A sweep is a walk in which one column rises from 0 to its highest value. A loop is a walk for a
looping picture.

A channel may have a module channels/<name>/shown.py with its own WORDS, `shown`, `sweeps` and `loops`. The
functions here use what this module has, and otherwise return defaults. Neither training nor measurements
depend on these modules.
"""

from __future__ import annotations

import importlib
import importlib.util
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from hobble.channels import all_channels, channel
from hobble.core.skeleton import Skeleton


@dataclass(frozen=True)
class ChannelWords:
    """Texts of a channel for the report page. {} stands for the name of a column.

    neutral_button: label of the button that sets all values to 0. slider_step: step of a slider. address_key:
    name of the values in the address of the page, by default the channel's name. sweep_description:
    description of a sweep. untrained_note: note on a column that is not trained. headline: headline of the
    page. network_told: what the network is told if the column is above 0. active_word: a word for a character
    with a value above 0; if it is empty, the column's name is used.
    """

    neutral_button: str = "Neutral"
    slider_step: float = 0.05
    address_key: str | None = None
    sweep_description: str = "Walks {} more and more"
    untrained_note: str = "always 0 in training, so it has no effect"
    headline: str = "Say how it walks."
    network_told: str = "{}"
    active_word: str = ""


@dataclass(frozen=True)
class ChannelDisplay:
    """How a channel is shown.

    spoken_names: for each column, the name that readers see. sliders: label of a slider -> its column, for
    the sliders that are there at the start. presets: label of a button -> {column: value}. regions: for each
    bone of the body, the indices of the columns whose values colour the part that this bone moves; empty if
    columns do not belong to parts of the body.
    """

    spoken_names: Sequence[str]
    sliders: Mapping[str, str]
    presets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    regions: Sequence[Sequence[int]] = ()


@dataclass(frozen=True)
class SampleWalk:
    """A walk for a looping picture.

    name: of the walk and its picture. values: column -> value. coloured: whether the values colour the body.
    """

    name: str
    values: Mapping[str, float]
    coloured: bool = False


def channel_words(name: str) -> ChannelWords:
    """The texts of the channel `name`."""
    return _own(name, "WORDS", ChannelWords())


def channel_display(
    name: str, skeleton: Skeleton, columns: Sequence[str], trained: Collection[str]
) -> ChannelDisplay:
    """How the channel `name` is shown. By default there is a slider for each trained column.

    columns: the labels of all columns. trained: the labels of the trained columns.
    """
    sliders = {column: column for column in columns if column in trained}
    return _own(name, "shown", ChannelDisplay(tuple(columns), sliders), skeleton, columns, trained)


def channel_sweeps(
    name: str, skeleton: Skeleton, columns: Sequence[str], trained: Collection[str]
) -> Mapping[str, str]:
    """Name of each sweep -> the column that rises. By default there is a sweep for each trained column.

    columns, trained: as in `channel_display`.
    """
    default = {column.replace(" ", "_"): column for column in columns if column in trained}
    return _own(name, "sweeps", default, skeleton, columns, trained)


def channel_loops(
    name: str, skeleton: Skeleton, columns: Sequence[str], trained: Collection[str]
) -> list[SampleWalk]:
    """Walks for looping pictures.

    By default there is a walk with all values 0, then one for each trained column with its highest value.
    columns, trained: as in `channel_display`.
    """
    highest = {column: channel(name).highest for column in columns if column in trained}
    neutral = SampleWalk(channel_words(name).neutral_button.lower(), {})
    default = [neutral, *(SampleWalk(c.replace(" ", "-"), {c: value}) for c, value in highest.items())]
    return _own(name, "loops", default, skeleton, columns, trained)


def other_names(
    name: str, skeleton: Skeleton | None, columns: Sequence[str], trained: Collection[str]
) -> Mapping[str, str]:
    """Other names of the channel's columns, such as those of parts of the body -> column. By default none.

    columns, trained: as in `channel_display`.
    """
    return {} if skeleton is None else _own(name, "other_names", {}, skeleton, columns, trained)


def shown_names(skeleton: Mapping[str, Any]) -> Callable[[str], str]:
    """A function from a column's label to the name that readers see. It returns any other text unchanged.

    skeleton: the entry `skeleton` of a network's file; empty if the file has none.
    """
    if not skeleton:
        return str
    rig = Skeleton.from_dict({"name": "", **skeleton})
    names: dict[str, str] = {}  # label of a column of any channel -> the name that readers see
    for each in all_channels():
        columns = each.columns(rig)
        names |= dict(
            zip(columns, channel_display(each.name, rig, columns, columns).spoken_names, strict=True)
        )
    return lambda column: names.get(column, column)


def _own(name: str, attribute: str, default: Any, *given: Any) -> Any:
    """What the module channels/<name>/shown.py says: a value, or what its function returns for `given`.

    default: if there is no such module, or the module has no such attribute.
    """
    full_name = f"hobble.channels.{name}.shown"
    if importlib.util.find_spec(full_name) is None:
        return default
    found = getattr(importlib.import_module(full_name), attribute, None)
    return default if found is None else found(*given) if callable(found) else found
