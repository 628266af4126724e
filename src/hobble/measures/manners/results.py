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
    """The names of the windows of one figure.

    value: 0, .5 or 1; None for two manners. named: manner -> windows that got this name. between: of two
    manners, position from the first (0) to the second (1).
    """

    manners: list[str]
    value: float | None
    windows: int
    share: float | None
    named: dict[str, int]
    between: NotRequired[float]


class CombinedResult(TypedDict):
    """The names of the windows of a manner while `column` of the channel `other` is at its highest."""

    channel: str
    manner: str
    other: str
    column: str
    windows: int
    share: float | None
    named: dict[str, int]


class Effect(TypedDict):
    """What a manner adds to the neutral walk. captured: None without neutral clips."""

    channel: str
    manner: str
    effect: str
    captured: float | None
    generated: float
    generated_at_half: float


class ChannelResult(TypedDict):
    """The result for one channel. speed_asked: m/s. right_at_1: share of the windows of manners at 1."""

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
