"""The schedule of the learning rate."""

from __future__ import annotations

import math

from hobble.training.options import Training


def learning_rate_share(training: Training, passes: float) -> float:
    """The factor of `training.learning_rate` after `passes` passes; `passes` may be a fraction.

    The factor rises linearly from 0 over `warm_up` passes. `constant` then stays at 1; `cosine` falls to 0 at
    the end of the last pass (Loshchilov and Hutter 2017, without restarts).

    >>> recipe = Training(schedule="cosine", warm_up=0.5, passes=8)
    >>> [round(learning_rate_share(recipe, passes), 3) for passes in (0, 0.25, 2, 4, 8)]
    [0.0, 0.499, 0.854, 0.5, 0.0]
    """
    rise = min(1.0, passes / training.warm_up) if training.warm_up else 1.0
    if training.schedule == "constant":
        return rise
    return rise * (1 + math.cos(math.pi * min(1.0, passes / training.passes))) / 2


def depends_on_passes(training: Training) -> bool:
    """Whether the number of passes changes the training from its start, not only its length."""
    return training.schedule != "constant"
