"""Moves a trajectory on by one frame: root and future path follow the network's prediction.

The compiled functions are in one file, because numba compiles a cached function again only if its own file
changes, not if the file of a function that it calls changes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import register_jitable

from hobble.character import rule
from hobble.core.compiled import njit
from hobble.rows.layout import RowLayout
from hobble.runtime.trajectory import STILL, Trajectory

phase_change, movement_share = register_jitable(rule.phase_change), register_jitable(rule.movement_share)

# If the predicted poses are recorded frames (motion matching), the root's movement is changed toward the
# target velocity. Across the target, the change is at most this share of the movement's length.
PULL = 0.2
# Along the target, the change is at most PULL * PULL_AHEAD of the movement's length. With more, the character
# takes corners faster and wider.
PULL_AHEAD = 0.5
# With other networks, this share of the movement against the target is removed. Removing all of it would drag
# the feet.
BACKWARD_LOSS = 0.5


@njit
def _pull(share: float, target_x: float, target_z: float, x: float, z: float) -> tuple[float, float]:
    """What to add to a movement (x, z) so that it comes nearer to the target movement.

    Across the target, at most `share` times the movement's length is added; along the target, at most
    PULL_AHEAD times as much. If the two directions shared one limit, a clip that is too slow would use it up,
    and the character would drift off its path.
    """
    most = share * np.sqrt(x * x + z * z)
    size = np.sqrt(target_x * target_x + target_z * target_z)
    ahead_x, ahead_z = (target_x / size, target_z / size) if size >= STILL else (0.0, 0.0)
    lack_x, lack_z = target_x - x, target_z - z
    along = lack_x * ahead_x + lack_z * ahead_z
    lack_x, lack_z = lack_x - along * ahead_x, lack_z - along * ahead_z
    along = min(max(along, -PULL_AHEAD * most), PULL_AHEAD * most)
    part = min(1.0, most / max(np.sqrt(lack_x * lack_x + lack_z * lack_z), 1e-9))
    return along * ahead_x + part * lack_x, along * ahead_z + part * lack_z


@njit
def _without_backward(
    loss: float, target_x: float, target_z: float, x: float, z: float
) -> tuple[float, float]:
    """The movement (x, z) without the share `loss` of its component against the target.

    If the target is slower than STILL, the share `loss` of the whole movement is removed.
    """
    speed = target_x * target_x + target_z * target_z
    if speed < STILL * STILL:
        return (1.0 - loss) * x, (1.0 - loss) * z
    against = loss * min(0.0, x * target_x + z * target_z) / speed
    return x - against * target_x, z - against * target_z


@njit
def advance(
    y: Any, at: Any, target: Any, loss: float, recorded_poses: bool, pull: float, path: Trajectory, phase: Any
) -> None:
    """Advance one frame: shift the past, move and turn the root, take the predicted future and phase change.

    y: (C, Y) prediction. at: first columns in y of root velocity, turn, phase change, position and direction,
    then the number of future samples and the frames between two samples. target: (C, 2) velocity.
    loss: share of the movement against the target that is removed; 0 in the runtime of Holden et al. (2017).
    recorded_poses: whether the predicted poses are recorded frames. If not, movement and turn are scaled by
    (1 - stand)^.25, where stand is the present share of the gait "stand".
    pull: largest change of the movement across the target, as a share of its length; 0 for no change. It is
    needed for recorded frames, because clips have only some directions and speeds. The idea is the adjustment
    of Holden et al. (2020).
    path, phase (C,): changed in place.
    The predicted turn is that of the world seen from the root, so the root turns by its negative.
    """
    position, direction, gait = path
    length = position.shape[1]
    middle = length // 2
    future, step = at[5], at[6]
    for c in range(y.shape[0]):
        for i in range(middle):
            for k in range(2):
                position[c, i, k] = position[c, i + 1, k]
                direction[c, i, k] = direction[c, i + 1, k]
            for k in range(gait.shape[2]):
                gait[c, i, k] = gait[c, i + 1, k]
        moving = 1.0 if recorded_poses else movement_share(gait[c, middle, 0])
        yaw = np.arctan2(direction[c, middle, 0], direction[c, middle, 1])
        sin, cos = np.sin(yaw), np.cos(yaw)
        vx, vz = y[c, at[0]], y[c, at[0] + 1]
        x, z = moving * (vx * cos + vz * sin), moving * (vz * cos - vx * sin)
        x, z = _without_backward(loss, target[c, 0], target[c, 1], x, z)
        more_x, more_z = _pull(pull, target[c, 0], target[c, 1], x, z)
        position[c, middle, 0] += x + more_x
        position[c, middle, 1] += z + more_z
        yaw -= moving * y[c, at[1]]
        sin, cos = np.sin(yaw), np.cos(yaw)
        direction[c, middle, 0], direction[c, middle, 1] = sin, cos
        for i in range(middle + 1, length):
            # Beyond the last predicted sample, extrapolate the line through the last two.
            place = (i - middle) / step
            k = min(int(place), future - 2)
            m = place - k
            p, d = at[3] + k, at[4] + k
            x = (1 - m) * y[c, p] + m * y[c, p + 1]
            z = (1 - m) * y[c, p + future] + m * y[c, p + future + 1]
            position[c, i, 0] = position[c, middle, 0] + x * cos + z * sin
            position[c, i, 1] = position[c, middle, 1] + z * cos - x * sin
            x = (1 - m) * y[c, d] + m * y[c, d + 1]
            z = (1 - m) * y[c, d + future] + m * y[c, d + future + 1]
            norm = max(np.sqrt(x * x + z * z), 1e-6)
            direction[c, i, 0] = (x * cos + z * sin) / norm
            direction[c, i, 1] = (z * cos - x * sin) / norm
        change = phase_change(moving, y[c, at[2]])
        phase[c] = phase[c] + change - np.floor(phase[c] + change)


def advance_columns(layout: RowLayout) -> np.ndarray:
    """The argument `at` of `advance`."""
    blocks = (
        layout.y_root_velocity, layout.y_turn, layout.y_phase_change, layout.y_position, layout.y_direction
    )  # fmt: skip
    return np.array([*(b.start for b in blocks), layout.future, layout.step], np.int64)
