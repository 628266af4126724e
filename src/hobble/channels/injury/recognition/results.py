"""The types of recognition.json.

A window is one second of a walk. For each window, the classifier names the links that hurt, or "healthy".
"""

from __future__ import annotations

from typing import NotRequired, TypedDict


class SeverityShare(TypedDict):
    """How windows, or whole walks, of one severity were recognised.

    windows, walks: how many have this severity; only one of these two keys is there. right: share in which
    the answer is right.
    """

    severity: float
    windows: NotRequired[int]
    walks: NotRequired[int]
    right: float | None


class RecognisedWindows(TypedDict):
    """How windows, or whole walks, were recognised.

    windows, walks: how many were judged; only one of these two keys is there. right: share in which the
    classifier names exactly what hurts. right_without_side: share in which it names the right parts of the
    body, on either side. confusion: what hurts -> what was recognised -> how many.
    """

    windows: NotRequired[int]
    walks: NotRequired[int]
    right: float | None
    right_without_side: float | None
    by_severity: list[SeverityShare]
    confusion: dict[str, dict[str, int]]


class RecognisedGenerated(RecognisedWindows):
    """How windows of generated walks were recognised. by_walk: the same, with one answer for each walk."""

    by_walk: RecognisedWindows


class RecognisedCaptured(TypedDict):
    """How captured windows were recognised.

    cross_validated: windows of training clips. Each quarter of a stretch of motion is judged by a classifier
    that learnt from the other quarters. held_out: windows of the held-out clips.
    """

    cross_validated: RecognisedWindows
    held_out: RecognisedWindows


class Recognition(TypedDict):
    """The content of recognition.json. If `applies` is false, it has only the first three keys and `reason`.

    people: share of hurt parts that people recognised in a published study. applies: whether anything could
    be measured. classes: the possible answers of the classifier: "healthy", and the links that hurt together
    in training. features: names of the classifier's inputs. chance: share that random guesses get right.
    captured: how captured clips were recognised. generated: how generated walks were recognised.
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
