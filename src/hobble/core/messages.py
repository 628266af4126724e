"""Words for messages: many of them in groups by kind, so that one that matters is not lost, and durations."""

import re
from collections.abc import Iterable
from typing import NamedTuple


class Group(NamedTuple):
    """Messages of one kind: the stage or level that they come from, their clips, and one of them."""

    stage: str
    clips: tuple[str, ...]
    message: str


def group_messages(messages: Iterable[tuple[str, str, str]]) -> list[Group]:
    """A group for each kind of message, of (clip, stage, sentence). Those of the first stage come first.

    Messages of one kind differ only in numbers and in what stands in parentheses. Within a stage, kinds with
    many clips come first.
    """
    kinds: dict[tuple[str, str], list[tuple[str, str]]] = {}
    stages: dict[str, int] = {}
    for clip, stage, sentence in messages:
        stages.setdefault(stage, len(stages))
        kinds.setdefault((stage, kind_of(sentence)), []).append((clip, sentence))
    groups = [
        Group(stage, tuple(dict.fromkeys(clip for clip, _ in found)), found[0][1])
        for (stage, _), found in kinds.items()
    ]
    return sorted(groups, key=lambda group: (stages[group.stage], -len(group.clips)))


def kind_of(sentence: str) -> str:
    """The sentence without numbers and what stands in parentheses: equal for messages of one kind."""
    return re.sub(r"\([^()]*\)|-?[0-9][0-9.,:/-]*", "0", sentence)


def in_words(group: Group) -> str:
    """A line about a group: its only clip, or the number of its clips and the first one."""
    if len(group.clips) == 1:
        return f"{group.clips[0]}: {group.message}"
    return f"{len(group.clips)} clips, such as {group.clips[0]}: {group.message}"


def format_duration(seconds: float | None) -> str:
    """A time as text in a suitable unit; a dash for None.

    >>> [format_duration(seconds) for seconds in (0.42, 59.4, 59.6, 93, 5400, 154800, None)]
    ['0.42 s', '59 s', '1 min', '1 min 33 s', '1 h 30 min', '43 h', '–']
    """
    if seconds is None:
        return "–"
    if round(seconds) < 60:
        return f"{seconds:.2g} s" if seconds < 10 else f"{seconds:.0f} s"
    minutes, more_seconds = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {more_seconds} s" if more_seconds else f"{minutes} min"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if minutes and hours < 24 else f"{hours} h"
