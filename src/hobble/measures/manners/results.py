"""The types of manners.json.

A manner is a mood or diagnosis. A window is one second of walking. The recogniser names the manner that it
finds in a window, or "none".
"""

from __future__ import annotations

from typing import NotRequired, TypedDict


class LeftOut(TypedDict):
    """How well the manner of captured people is recognised after learning from all other people.

    shrinkage: how much the recogniser's covariance is shrunk towards its diagonal, 0 to 1. people: number of
    people. people_of: manner -> number of people. windows: number of windows that were named. right: share of
    these windows that were named right. by_manner: manner -> share of its windows that were named right.
    presence_right: share of windows for which the recogniser says correctly whether there is any manner.
    """

    shrinkage: float
    people: int
    people_of: dict[str, int]
    windows: int
    right: float | None
    by_manner: dict[str, float | None]
    presence_right: float | None


class NamedWindows(TypedDict):
    """The names that the recogniser gives to the windows of a generated walk with no, one or two manners.

    manners: the manners of the walk. value: .5 or 1, the value of the manner; 0 without a manner, None for
    two manners. windows: number of windows. share: share of windows named right; with two manners, either
    name is right. named: manner -> number of windows that got this name. between: for two manners, how far
    the features of the walk are from those with the first manner alone (0) to those with the second alone
    (1).
    """

    manners: list[str]
    value: float | None
    windows: int
    share: float | None
    named: dict[str, int]
    between: NotRequired[float]


class CombinedResult(TypedDict):
    """The names that the recogniser gives to the windows of a generated walk with values of two channels.

    In the channel `channel`, `manner` has the value 1, or all values are 0 if it is "none". In the channel
    `other`, `column` has its highest value. windows: number of windows. share: share of windows named right.
    named: manner -> number of windows that got this name.
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

    effect: one of EFFECTS in `hobble.measures.manners.windows`; `MannerWindow` there has the units. captured:
    the change in captured walks; None without neutral clips. generated: the change in generated walks in
    which the manner has the value 1. generated_at_half: the same with the value .5.
    """

    channel: str
    manner: str
    effect: str
    captured: float | None
    generated: float
    generated_at_half: float


class ChannelResult(TypedDict):
    """The result for one channel.

    title: the channel's name on the page. manners: those that were learnt. speed_asked: the middle one of the
    target speeds of generated walks, m/s. captured: recognition of captured people. generated: for walks
    without a manner, with each manner at .5 and at 1, and with each pair of manners, how often a recogniser
    trained on the training clips is right. right_at_1: share of windows named right in all walks with one
    manner at 1. together: recognition of each manner while a column of another channel is at its highest
    value. effects: how much each manner changes each quantity from the neutral walk.
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
    """The content of manners.json.

    applies: whether there are manners to measure. reason: why not, if `applies` is false. channels: the
    result for each channel, if `applies` is true.
    """

    applies: bool
    reason: NotRequired[str]
    channels: NotRequired[list[ChannelResult]]
