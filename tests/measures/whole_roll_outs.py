"""All poses of the roll-outs of one stretch, for tests that compare them one by one."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.measures.rollouts.roll_outs import Crowd, RollOutInputs, RollOuts
from hobble.models.network import Predictor


def roll_out(
    predictor: Predictor, inputs: RollOutInputs, starts: np.ndarray, length: int
) -> tuple[list[Array], Array]:
    """The joints of roll-outs that begin at frames `starts` (n,), which rise, and their last phases (n,).

    For each age from 1 to `length` there is an array (n', J, 3), in the root frame of frame start + age - 1,
    with heights minus that frame's mean. It holds the first n' roll-outs, those still inside the stretch.
    """
    crowd = Crowd(predictor, [RollOuts(inputs, starts, length)])
    return [place for _, place, _ in crowd.frames()], crowd.phase
