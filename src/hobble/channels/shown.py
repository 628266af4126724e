"""How a channel is shown on the report page and in pictures: words, sliders, presets, sweeps and loops.

A channel is a group of inputs of the network, such as the severities of injuries. Each input is a column with
a label. "Trained" columns are those that were above 0 in training. A preset is a button that sets several
columns. A sweep is a walk in which one column rises from 0 to its highest value. A loop is a walk for a
looping picture.

A channel may have a module channels/<name>/shown.py with its own function `display`. Neither training nor
measurements depend on these modules.
"""

import importlib
import importlib.util
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from hobble.channels import all_channels, channel
from hobble.core.skeleton import Skeleton


@dataclass(frozen=True)
class SampleWalk:
    """A walk for a looping picture.

    name: of the walk and its picture. values: column -> value. coloured: whether the values colour the body.
    """

    name: str
    values: Mapping[str, float]
    coloured: bool = False


@dataclass(frozen=True)
class ChannelDisplay:
    """How a channel is shown for a skeleton.

    spoken_names: for each column, the name that readers see. sliders: label of a slider -> its column, for
    the sliders that are there at the start. presets: label of a button -> {column: value}. regions: for each
    bone of the body, the indices of the columns whose values colour the part that this bone moves; empty if
    columns do not belong to parts of the body. sweeps: name of each sweep -> the column that rises. loops:
    walks for looping pictures. other_names: other names of columns, such as those of parts of the body ->
    column.

    Texts of the page, in which {} stands for the name of a column. neutral_button: label of the button that
    sets all values to 0. slider_step: step of a slider. address_key: name of the values in the address of
    the page, by default the channel's name. untrained_note: note on a column that is not trained. headline:
    headline of the page. network_told: what the network is told if the column is above 0. active_word: a word
    for a character with a value above 0; if it is empty, the column's name is used.
    """

    spoken_names: Sequence[str]
    sliders: Mapping[str, str]
    sweeps: Mapping[str, str]
    loops: Sequence[SampleWalk]
    presets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    regions: Sequence[Sequence[int]] = ()
    other_names: Mapping[str, str] = field(default_factory=dict)
    neutral_button: str = "Neutral"
    slider_step: float = 0.05
    address_key: str | None = None
    untrained_note: str = "always 0 in training, so it has no effect"
    headline: str = "Say how it walks."
    network_told: str = "{}"
    active_word: str = ""


def channel_display(
    name: str, skeleton: Skeleton, columns: Sequence[str], trained: Collection[str]
) -> ChannelDisplay:
    """How the channel `name` is shown. By default each trained column has a slider, a sweep and a loop.

    columns: the labels of all columns. trained: the labels of the trained columns.
    """
    module = f"hobble.channels.{name}.shown"
    if importlib.util.find_spec(module) is not None:
        display: ChannelDisplay = importlib.import_module(module).display(skeleton, columns, trained)
        return display
    used, highest = [column for column in columns if column in trained], channel(name).highest
    return ChannelDisplay(
        tuple(columns),
        sliders={column: column for column in used},
        sweeps={column.replace(" ", "_"): column for column in used},
        loops=[SampleWalk("neutral", {}), *(SampleWalk(c.replace(" ", "-"), {c: highest}) for c in used)],
    )


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
        spoken = channel_display(each.name, rig, columns, columns).spoken_names
        names |= dict(zip(columns, spoken, strict=True))
    return lambda column: names.get(column, column)
