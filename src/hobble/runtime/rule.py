"""How a network's prediction changes the character's state, as in the runtime of Holden et al. (2017).

The functions take numbers, numpy arrays or tensors. The runtime compiles them with numba; roll-outs and
training call them directly. The only other implementation is in the report page's JavaScript.
"""

from typing import Any

import numpy as np

CARRIED_SHARE = 0.5  # weight of `carried` and of `predicted` in a joint's new position
STANDING_SHARE = 0.1  # share of the predicted change of phase that is applied to a standing character


def joint_place(carried: Any, predicted: Any) -> Any:
    """New joint positions: the mean of `carried` (old position plus velocity) and `predicted`."""
    return CARRIED_SHARE * (carried + predicted)


def movement_share(stand: Any) -> Any:
    """The share (0 to 1) of the root's predicted movement that is applied. It is 0 for a standing character.

    stand: share of the gait "stand". At 0.9375, half of the movement is still applied.
    """
    return np.maximum(0.0, 1.0 - stand) ** 0.25


def phase_change(share: Any, predicted: Any) -> Any:
    """The change of phase that is applied, cycles.

    share: from `movement_share`. predicted: the change that the network predicts, cycles.
    """
    return ((1.0 - STANDING_SHARE) * share + STANDING_SHARE) * predicted
