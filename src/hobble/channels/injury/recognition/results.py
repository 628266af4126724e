"""The types of recognition.json."""

from __future__ import annotations

from typing import NotRequired, TypedDict


class SeverityShare(TypedDict):
    """How many windows, or walks, there are of one severity, and the share `right` that is recognised."""

    severity: float
    windows: NotRequired[int]
    walks: NotRequired[int]
    right: float | None


class RecognisedWindows(TypedDict):
    """How windows, or whole walks, were recognised.

    right: share in which the links that hurt are named. right_without_side: share in which the part of the
    body is named, on either side. confusion: what hurts -> what was recognised -> how many.
    """

    windows: NotRequired[int]
    walks: NotRequired[int]
    right: float | None
    right_without_side: float | None
    by_severity: list[SeverityShare]
    confusion: dict[str, dict[str, int]]


class RecognisedGenerated(RecognisedWindows):
    """How windows of generated walks were recognised. by_walk: with one answer for each whole walk."""

    by_walk: RecognisedWindows


class RecognisedCaptured(TypedDict):
    """How captured windows were recognised.

    cross_validated: those of training clips, with each quarter of every stretch left out of learning in turn.
    held_out: those of the held-out clips.
    """

    cross_validated: RecognisedWindows
    held_out: RecognisedWindows


class Recognition(TypedDict):
    """recognition.json. If `applies` is false, it has only the first three keys and `reason`.

    people: share that people recognised in a published study. chance: share that a random guess gets right.
    See `recognition`.
    """

    configuration: str
    people: float
    applies: bool
    reason: NotRequired[str]
    classes: NotRequired[list[str]]
    features: NotRequired[list[str]]
    chance: NotRequired[float]
    captured: NotRequired[RecognisedCaptured]
    generated: NotRequired[RecognisedGenerated]
