"""The types of accuracy.json."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from hobble.measures.results import SampleSize


class ErrorNumbers(TypedDict):
    """Errors over `frames` frames.

    mean, sd, p05 to p95: mean, standard deviation and percentiles of the relative error of a joint, that is,
    the error of its position as a fraction of its captured distance from the root (see
    `hobble.measures.accuracy.run`). position_error_cm: mean distance between the predicted and the captured
    position of a joint. If `frames` is 0, the means and sd are None, and there are no percentiles.
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
    """The errors of an excerpt of a clip. first_frame, last_frame: its first and last frame in the clip."""

    first_frame: int
    last_frame: int


class ErrorsOfSplit(ErrorNumbers):
    """The errors over all clips of a split.

    clips: number of clips with measured frames. mean_of_clips: the mean of the mean relative errors of these
    clips. interval: "mean" or "position_error_cm" -> half the width of its 95 % confidence interval, if only
    a sample was measured.
    """

    clips: int
    mean_of_clips: float | None
    interval: NotRequired[dict[str, float]]


class Accuracy(TypedDict):
    """The content of accuracy.json, and `excerpts`, which are written to a table instead.

    joints: number of measured joints. sample, excerpts: the size of the sample and the errors of each of its
    excerpts; missing if all clips were measured as a whole.
    """

    configuration: str
    joints: int
    clips: list[ErrorsOfClip]
    train: ErrorsOfSplit
    held_out: ErrorsOfSplit
    sample: NotRequired[SampleSize]
    excerpts: NotRequired[list[ErrorsOfExcerpt]]
