"""The types of rollouts.json."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from hobble.measures.results import SampleSize


class ErrorsOf(TypedDict):
    """Errors over `frames` frames of roll-outs, None if there were none.

    mean, sd: of the relative error. last_cm, last_phase: position error, and phase error in cycles, in the
    last frame of the `ended` roll-outs that reached their full length. interval: half width of the 95 %
    confidence interval of `position_error_cm`, for a split of which only a sample was measured.
    """

    frames: int
    mean: float | None
    sd: float | None
    position_error_cm: float | None
    ended: int
    last_cm: float | None
    last_phase: float | None
    interval: NotRequired[dict[str, float]]


class ErrorsOfClip(ErrorsOf):
    """The errors of one clip. split: "train" or "held_out"."""

    clip: str
    split: str


class OfLength(TypedDict):
    """The errors of roll-outs over `length` frames."""

    length: int
    train: ErrorsOf
    held_out: ErrorsOf
    clips: list[ErrorsOfClip]


class RollOutsFound(TypedDict):
    """rollouts.json. joints: how many were measured. mode: how the phase was looked up."""

    configuration: str
    joints: int
    mode: str
    lengths: list[OfLength]
    sample: NotRequired[SampleSize]
