"""Roll-outs of one clip alone, for tests: the errors of all, or all poses of those of a stretch."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.measures.rollouts_run import (
    RollOutCrowd,
    RollOutInputs,
    roll_out_sums,
    stretches_of,
    values_of_sums,
)
from hobble.measures.sample import LoadedPart
from hobble.models.network import Predictor
from hobble.rows.clip_rows import ClipRows


def roll_out(
    predictor: Predictor, inputs: RollOutInputs, starts: np.ndarray, length: int
) -> tuple[list[Array], Array]:
    """The joints of roll-outs that begin at frames `starts` (n,), which rise, and their last phases (n,).

    For each age from 1 to `length` there is an array (n', J, 3), in the root frame of frame start + age - 1,
    with heights minus that frame's mean. It holds the first n' roll-outs, those still inside the stretch.
    """
    crowd = RollOutCrowd(predictor, inputs, starts, np.minimum(starts + length, len(inputs.x)))
    return [place for *_, place in crowd.frames()], crowd.phase


def clip_roll_outs(
    predictor: Predictor, rows: ClipRows, joints: Sequence[int], lengths: Sequence[int]
) -> dict[int, dict[str, Any]]:
    """Length -> errors of all roll-outs of the clip."""
    stretches = stretches_of(LoadedPart(rows, 0, len(rows)), predictor.network.layout)
    sums = {n: roll_out_sums(predictor, stretches, joints, n).sum(axis=0) for n in lengths}
    return {n: values_of_sums(of_length) for n, of_length in sums.items()}
