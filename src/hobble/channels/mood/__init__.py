"""The mood channel: for each of five moods a column with values from 0 to 1. A neutral clip has 0 in all."""

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Annotated, Any, Literal, get_args

from pydantic import Field

from hobble.channels.channel import ClipChannel, ClipSource, HasLinks
from hobble.core.section import Section

MoodName = Literal["tired", "old", "happy", "sad", "angry"]
Amount = Annotated[float, Field(ge=0, le=1)]


class Patterns(Section):
    """The section `channels.mood` of a data set: which clips have which mood."""

    patterns: dict[str, dict[MoodName, Amount]] = Field(
        description="pattern of clip names -> {mood: amount}; * in a pattern stands for any text; the first "
        "pattern that fits a clip's name counts"
    )


class Mood(ClipChannel):
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
    Value = dict[MoodName, Amount]

    def columns(self, rig: HasLinks) -> tuple[str, ...]:
        """The names of the moods, one for each column."""
        return get_args(MoodName)

    def values_of(self, source: ClipSource) -> Sequence[float] | None:
        """As in `ClipChannel`."""
        patterns = source.options.patterns if isinstance(source.options, Patterns) else {}
        fitting = (moods for pattern, moods in patterns.items() if fnmatchcase(source.clip, pattern))
        moods: Mapping[Any, float] | None = source.value if source.value is not None else next(fitting, None)
        return None if moods is None else [moods.get(mood, 0.0) for mood in get_args(MoodName)]


CHANNEL = Mood()
