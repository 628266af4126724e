"""How the learning rate changes during a training."""

from __future__ import annotations

import math

from hobble.training.options import Training


def learning_rate_share(training: Training, passes: float) -> float:
    """The factor by which `training.learning_rate` is multiplied after `passes` passes over the data.

    passes: may be a fraction. During the first `training.warm_up` passes the factor rises linearly from 0. If
    the schedule is `constant`, it then stays at 1. If the schedule is `cosine`, it is also multiplied by half
    a cosine wave, which falls from 1 at the start to 0 at the end of the last pass (Loshchilov and Hutter
    2017, without restarts).

    >>> recipe = Training(schedule="cosine", warm_up=0.5, passes=8)
    >>> [round(learning_rate_share(recipe, passes), 3) for passes in (0, 0.25, 2, 4, 8)]
    [0.0, 0.499, 0.854, 0.5, 0.0]
    """
    rise = min(1.0, passes / training.warm_up) if training.warm_up else 1.0
    if training.schedule == "constant":
        return rise
    return rise * (1 + math.cos(math.pi * min(1.0, passes / training.passes))) / 2


def depends_on_passes(training: Training) -> bool:
    """Whether the learning rate depends on the total number of passes.

    If it does not, a training with more passes only continues a shorter one.
    """
    return training.schedule != "constant"
