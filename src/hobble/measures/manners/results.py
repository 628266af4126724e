"""The parts of manners.json, which the page reads."""

from __future__ import annotations

from typing import NotRequired, TypedDict


class LeftOut(TypedDict):
    """Recognition of captured people after learning from all others; see `left_out.left_out`."""

    shrinkage: float
    people: int
    people_of: dict[str, int]
    windows: int
    right: float | None
    by_manner: dict[str, float | None]
    presence_right: float | None


class NamedWindows(TypedDict):
    """The names that the recogniser gives to the windows of a walk with no, one or two manners.

    value: of the manner: 0, .5 or 1; None for two manners. share: of windows named right. named: manner ->
    number of windows that got this name. between: for two manners, where the walk lies between the walks with
    the first alone (0) and with the second alone (1).
    """

    manners: list[str]
    value: float | None
    windows: int
    share: float | None
    named: dict[str, int]
    between: NotRequired[float]


class CombinedResult(TypedDict):
    """The names of the windows of a manner while `column` of the channel `other` is at its highest.

    share: of windows named right. named: manner -> number of windows that got this name.
    """

    channel: str
    manner: str
    other: str
    column: str
    windows: int
    share: float | None
    named: dict[str, int]


class Effect(TypedDict):
    """How much a manner changes the quantity `effect` from the neutral walk, in the units of `MannerWindow`.

    captured: None without neutral clips. generated: with a value of 1.
    """

    channel: str
    manner: str
    effect: str
    captured: float | None
    generated: float
    generated_at_half: float


class ChannelResult(TypedDict):
    """The result for one channel, see `run.of_channel`.

    speed_asked: m/s. right_at_1: share of windows named right, of all walks with one manner at 1.
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
    """manners.json. It has `reason` if it does not apply, `channels` if it does."""

    applies: bool
    reason: NotRequired[str]
    channels: NotRequired[list[ChannelResult]]
