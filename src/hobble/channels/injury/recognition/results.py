"""The types of recognition.json."""

from __future__ import annotations

from typing import NotRequired, TypedDict


class OfSeverity(TypedDict):
    """The share of the windows, or of the walks, of one severity that is named right."""

    severity: float
    windows: NotRequired[int]
    walks: NotRequired[int]
    right: float | None


class Judged(TypedDict):
    """How windows, or whole walks, were named. confusion: what hurts -> what was recognised -> how many."""

    windows: NotRequired[int]
    walks: NotRequired[int]
    right: float | None
    right_without_side: float | None
    by_severity: list[OfSeverity]
    confusion: dict[str, dict[str, int]]


class OfGenerated(Judged):
    """Generated windows. by_walk: with one answer for a whole walk."""

    by_walk: Judged


class OfCaptured(TypedDict):
    """Captured windows: a quarter of every stretch left out in turn, and the held-out clips."""

    cross_validated: Judged
    held_out: Judged


class Recognition(TypedDict):
    """recognition.json. It has only the first keys and `reason` if `applies` is false. See `recognition`."""

    configuration: str
    people: float
    applies: bool
    reason: NotRequired[str]
    classes: NotRequired[list[str]]
    features: NotRequired[list[str]]
    chance: NotRequired[float]
    captured: NotRequired[OfCaptured]
    generated: NotRequired[OfGenerated]
