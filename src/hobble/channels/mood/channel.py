"""The mood channel: a column from 0 to 1 for each of five moods. All are 0 in a neutral clip."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import Field

from hobble.channels.channel import Channel, ClipSource, HasLinks
from hobble.core.section import Section

if TYPE_CHECKING:
    from hobble.core.clip import Clip
    from hobble.core.quat import Array

Name = Literal["tired", "old", "happy", "sad", "angry"]
Amount = Annotated[float, Field(ge=0, le=1)]


class Patterns(Section):
    """The section `channels.mood` of a data set: which clips have which mood."""

    patterns: dict[str, dict[Name, Amount]] = Field(
        description="pattern of clip names -> mood; * stands for any text; the first pattern that fits counts"
    )


class Mood(Channel):
    """The mood of a whole clip.

    It comes from the clip's entry in the data set ({sad: .5}), else from the first pattern that fits the
    clip's name. The fields are explained in `hobble.channels.channel.Channel`.
    """

    name = "mood"
    title = "Mood"
    value = "amount"
    highest = 1.0
    rate = 1.0
    slows = True  # sad people walk at half the usual speed
    manner = True
    Options = Patterns

    def columns(self, rig: HasLinks) -> tuple[str, ...]:
        """The names of the moods, one for each column."""
        return get_args(Name)

    def is_neutral(self, source: ClipSource) -> bool:
        """Whether all moods are 0 in the clip's entry or, without an entry, in its pattern."""
        return not any(_moods(source).values())

    def check(self, source: ClipSource, rig: HasLinks) -> None:
        """Raise InputError if the clip's entry has unknown moods or values outside 0..1."""
        from hobble.core.errors import InputError

        given = source.value
        moods = isinstance(given, Mapping) and set(given) <= set(self.columns(rig))
        if given is not None and not (
            moods and all(isinstance(v, int | float) and 0 <= v <= 1 for v in given.values())
        ):
            fix = f"Use {', '.join(self.columns(rig))} with numbers from 0 to 1, as in {{sad: .5}}."
            raise InputError(f"{source.clip}.channels.{self.name}", f"cannot be {given!r:.80}", fix=fix)

    def read(self, clip: Clip, source: ClipSource, motion: Mapping[str, Any]) -> tuple[Array, list[str]]:
        """The same values in all frames, and a warning if no pattern fits."""
        import numpy as np

        moods = _moods(source)
        row = [float(moods.get(mood, 0.0)) for mood in self.columns(clip.skeleton)]
        fits = source.value is not None or any(fnmatchcase(source.clip, p) for p in _patterns(source))
        warnings = (
            [] if fits else [f"no pattern of channels.{self.name} fits {source.clip}; it counts as neutral."]
        )
        return np.tile(np.array(row, np.float32), (len(clip), 1)), warnings


def _patterns(source: ClipSource) -> Mapping[str, Mapping[Name, float]]:
    return source.options.patterns if isinstance(source.options, Patterns) else {}


def _moods(source: ClipSource) -> Mapping[Any, float]:
    if source.value is not None:
        return source.value
    for pattern, moods in _patterns(source).items():
        if fnmatchcase(source.clip, pattern):
            return moods
    return {}


CHANNEL = Mood()
