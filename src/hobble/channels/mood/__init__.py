"""The mood channel: for each of five moods a column with values from 0 to 1. A neutral clip has 0 in all."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import Annotated, Any, Literal, get_args

import numpy as np
from pydantic import Field

from hobble.channels.channel import Channel, ClipSource, HasLinks
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.section import Section

MoodName = Literal["tired", "old", "happy", "sad", "angry"]
Amount = Annotated[float, Field(ge=0, le=1)]


class Patterns(Section):
    """The section `channels.mood` of a data set: which clips have which mood."""

    patterns: dict[str, dict[MoodName, Amount]] = Field(
        description="pattern of clip names -> {mood: amount}; * in a pattern stands for any text; the first "
        "pattern that fits a clip's name counts"
    )


class Mood(Channel):
    """The channel whose values say how tired, old, happy, sad or angry the person in a clip is.

    A clip has the same values in all frames. They come from the clip's entry in the data set, such as
    {sad: .5}. If the entry has none, they come from the first pattern that fits the clip's name. The fields
    below are explained in `hobble.channels.channel.Channel`.
    """

    name = "mood"
    title = "Mood"
    value_word = "amount"
    highest = 1.0
    rate = 1.0
    slows = True  # sad people walk at half the usual speed
    manner = True
    Options = Patterns

    def columns(self, rig: HasLinks) -> tuple[str, ...]:
        """The names of the moods, one for each column."""
        return get_args(MoodName)

    def is_neutral(self, source: ClipSource) -> bool:
        """Whether all moods are 0 in the clip's entry or, without an entry, in its pattern."""
        return not any(_moods(source).values())

    def check(self, source: ClipSource, rig: HasLinks) -> None:
        """Raise InputError if the clip's entry has unknown moods or values outside 0..1."""
        given = source.value
        names_are_known = isinstance(given, Mapping) and set(given) <= set(self.columns(rig))
        if given is not None and not (
            names_are_known and all(isinstance(v, int | float) and 0 <= v <= 1 for v in given.values())
        ):
            fix = f"Use {', '.join(self.columns(rig))} with numbers from 0 to 1, as in {{sad: .5}}."
            raise InputError(f"{source.clip}.channels.{self.name}", f"cannot be {given!r:.80}", fix=fix)

    def read(self, clip: Clip, source: ClipSource, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """Values (F, 5) of a clip with F frames, the same in each. A warning if nothing says its mood."""
        moods = _moods(source)
        row = [float(moods.get(mood, 0.0)) for mood in self.columns(clip.skeleton)]
        fits = source.value is not None or any(fnmatchcase(source.clip, p) for p in _patterns(source))
        warnings = (
            [] if fits else [f"no pattern of channels.{self.name} fits {source.clip}; it counts as neutral."]
        )
        return np.tile(np.array(row, np.float32), (len(clip), 1)), warnings


def _patterns(source: ClipSource) -> Mapping[str, Mapping[MoodName, float]]:
    """Pattern of clip names -> {mood: amount}, from the data set's section `channels.mood`."""
    return source.options.patterns if isinstance(source.options, Patterns) else {}


def _moods(source: ClipSource) -> Mapping[Any, float]:
    """Mood -> amount, for the clip of `source`. Moods that are not in it have the amount 0."""
    if source.value is not None:
        return source.value
    for pattern, moods in _patterns(source).items():
        if fnmatchcase(source.clip, pattern):
            return moods
    return {}


CHANNEL = Mood()
