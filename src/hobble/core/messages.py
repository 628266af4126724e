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


def duration(seconds: float) -> str:
    """A duration as text.

    >>> duration(42.4), duration(754), duration(7512)
    ('42 s', '12 min 34 s', '2 h 05 min')
    """
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    if seconds < 3600:
        return f"{seconds // 60} min {seconds % 60:02d} s"
    return f"{seconds // 3600} h {seconds % 3600 // 60:02d} min"
