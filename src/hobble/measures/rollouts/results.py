"""The types of rollouts.json."""

from __future__ import annotations

from typing import NotRequired, TypedDict

from hobble.measures.results import SampleSize


class RollOutNumbers(TypedDict):
    """Errors over `frames` frames of roll-outs. They are None if there were no frames.

    position_error_cm: mean distance between a joint and its captured position. mean, sd: mean and standard
    deviation of the relative error: this distance divided by the distance between the captured joint and the
    root. ended: number of roll-outs that reached their full length. last_cm: mean position error in the last
    frame of these roll-outs. last_phase: mean phase error after their last frame, cycles. interval:
    `position_error_cm` -> half width of its 95 % confidence interval, if only a sample was measured.
    """

    frames: int
    mean: float | None
    sd: float | None
    position_error_cm: float | None
    ended: int
    last_cm: float | None
    last_phase: float | None
    interval: NotRequired[dict[str, float]]


class ErrorsOfClip(RollOutNumbers):
    """The errors of one clip. split: "train" or "held_out"."""

    clip: str
    split: str


class LengthErrors(TypedDict):
    """The errors of roll-outs over `length` frames."""

    length: int
    train: RollOutNumbers
    held_out: RollOutNumbers
    clips: list[ErrorsOfClip]


class RollOutResults(TypedDict):
    """rollouts.json.

    joints: number of joints measured. mode: the network's phase mode. sample: the size of the sample, if only
    a sample was measured.
    """

    configuration: str
    joints: int
    mode: str
    lengths: list[LengthErrors]
    sample: NotRequired[SampleSize]
