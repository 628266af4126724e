"""The types of manners.json."""

from __future__ import annotations

from typing import NotRequired, TypedDict


class LeftOut(TypedDict):
    """How well the manner of captured people is recognised after learning from all other people.

    shrinkage: of the recogniser's covariance towards its diagonal. people: number of persons. people_of:
    number of persons with each manner. windows: number of windows that were named. right: share of them that
    were named right. by_manner: the same for each manner. presence_right: share of windows in which the
    recogniser says correctly whether there is any manner.
    """

    shrinkage: float
    people: int
    people_of: dict[str, int]
    windows: int
    right: float | None
    by_manner: dict[str, float | None]
    presence_right: float | None


class NamedWindows(TypedDict):
    """The names that the recogniser gives to the windows of a walk with no, one or two manners.

    value: value of the manner, 0 if there is none, else .5 or 1; None for two manners. windows: their number.
    share: share of windows named right. named: manner -> number of windows that got this name. In a walk with
    two manners, either name is right. between: for two manners, where the walk lies between the walks with
    the first alone (0) and with the second alone (1).
    """

    manners: list[str]
    value: float | None
    windows: int
    share: float | None
    named: dict[str, int]
    between: NotRequired[float]


class CombinedResult(TypedDict):
    """The names that the recogniser gives to the windows of a walk with values of two channels.

    A manner is at 1, and `column` of the channel `other` is at its highest value. windows: their number.
    share: share of windows named right. named: manner -> number of windows that got this name.
    """

    channel: str
    manner: str
    other: str
    column: str
    windows: int
    share: float | None
    named: dict[str, int]


class Effect(TypedDict):
    """How much a manner changes the quantity `effect` from the neutral walk.

    The units are those of `MannerWindow` in `hobble.measures.manners.windows`. captured: None without neutral
    clips. generated: in generated walks with a value of 1. generated_at_half: the same with a value of .5.
    """

    channel: str
    manner: str
    effect: str
    captured: float | None
    generated: float
    generated_at_half: float


class ChannelResult(TypedDict):
    """The result for one channel.

    speed_asked: middle one of the target speeds of generated walks, m/s. captured: recognition of captured
    people. generated: for each manner and value, and for each pair of manners, how often a recogniser trained
    on the training clips is right. right_at_1: share of windows named right in all walks with one manner at
    1. together: recognition of each manner while a column of another channel is at its highest value.
    effects: how much each manner changes the walk from neutral.
    """

    channel: str
    title: str
    manners: list[str]
    speed_asked: float
    captured: LeftOut
    generated: list[NamedWindows]
    right_at_1: float | None
    together: list[CombinedResult]
    effects: list[Effect]


class Manners(TypedDict):
    """manners.json. applies: whether there are manners to measure. If not, `reason` says why.

    channels: the result for each channel, if `applies` is true.
    """

    applies: bool
    reason: NotRequired[str]
    channels: NotRequired[list[ChannelResult]]
