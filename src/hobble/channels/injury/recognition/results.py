"""The types of recognition.json."""

from __future__ import annotations

from typing import NotRequired, TypedDict


class SeverityShare(TypedDict):
    """How many `windows`, or whole `walks`, have one severity, and the share that is recognised right."""

    severity: float
    windows: NotRequired[int]
    walks: NotRequired[int]
    right: float | None


class RecognisedWindows(TypedDict):
    """How windows, or whole walks, were recognised.

    windows, walks: how many; only one of these two keys is there. right: share in which the links that hurt
    are named. right_without_side: share in which the part of the body is named, on either side. confusion:
    what hurts -> what was recognised -> how many.
    """

    windows: NotRequired[int]
    walks: NotRequired[int]
    right: float | None
    right_without_side: float | None
    by_severity: list[SeverityShare]
    confusion: dict[str, dict[str, int]]


class RecognisedGenerated(RecognisedWindows):
    """How windows of generated walks were recognised. by_walk: with one answer for a whole walk."""

    by_walk: RecognisedWindows


class RecognisedCaptured(TypedDict):
    """How captured windows were recognised.

    cross_validated: windows of training clips. Each quarter of a stretch of motion is judged by a classifier
    that learnt from the other quarters. held_out: windows of the held-out clips.
    """

    cross_validated: RecognisedWindows
    held_out: RecognisedWindows


class Recognition(TypedDict):
    """recognition.json. If `applies` is false, it has only the first three keys and `reason`.

    people: share of hurt parts that people recognised in a published study. classes: what the classifier can
    answer: "healthy", or the links that hurt. features: names of its inputs. chance: share that a random
    guess gets right. captured, generated: how captured clips and generated walks were recognised.
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
