"""The types of accuracy.json."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from hobble.measures.results import SampleSize


class ErrorNumbers(TypedDict):
    """Errors over `frames` frames. mean, sd, p05 to p95 (percentiles): of the relative error.

    position_error_cm: mean distance between the predicted and the captured position of a joint. If `frames`
    is 0, then the means and sd are None and the percentiles are missing.
    """

    frames: int
    mean: float | None
    sd: float | None
    position_error_cm: float | None
    p05: NotRequired[float]
    p25: NotRequired[float]
    p50: NotRequired[float]
    p75: NotRequired[float]
    p95: NotRequired[float]


class ErrorsOfClip(ErrorNumbers):
    """The errors of one clip. split: "train" or "held_out"."""

    clip: str
    split: str


class ErrorsOfExcerpt(ErrorsOfClip):
    """The errors of an excerpt of a clip. first_frame, last_frame: frames of the clip."""

    first_frame: int
    last_frame: int


class ErrorsOfSplit(ErrorNumbers):
    """The errors of all clips of a split.

    clips: their number. mean_of_clips: the mean of their mean relative errors. interval: half widths of the
    95 % confidence intervals of `mean` and `position_error_cm`, if only a sample was measured.
    """

    clips: int
    mean_of_clips: float | None
    interval: NotRequired[dict[str, float]]


class Accuracy(TypedDict):
    """The content of accuracy.json, and `excerpts`, which go to a table. joints: how many were measured.

    sample, excerpts: only if a sample was measured.
    """

    configuration: str
    joints: int
    clips: list[ErrorsOfClip]
    train: ErrorsOfSplit
    held_out: ErrorsOfSplit
    sample: NotRequired[SampleSize]
    excerpts: NotRequired[list[ErrorsOfExcerpt]]
