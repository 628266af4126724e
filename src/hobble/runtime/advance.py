"""Moves trajectories on by one frame: the root and the future path follow the network's prediction.

A trajectory is the character's path on the ground, half past and half future. The compiled functions are in
one file, because numba compiles a cached function again only if its own file changes. A change in the file of
a function that it calls is not noticed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import register_jitable

from hobble.core.compiled import njit
from hobble.rows.layout import RowLayout
from hobble.runtime import rule
from hobble.runtime.trajectory import STILL, Trajectory

phase_change, movement_share = register_jitable(rule.phase_change), register_jitable(rule.movement_share)

# If the predicted poses are recorded frames (motion matching), the root's movement in a frame is changed
# toward the target velocity. At right angles to the target, the change is at most this share of the
# movement's length.
PULL = 0.2
# Along the target, the change is at most PULL * PULL_AHEAD times the movement's length. With a higher limit,
# the character takes corners faster and wider.
PULL_AHEAD = 0.5
# With other networks, if the predicted movement goes against the target, this share of its backward part is
# removed. If all of it were removed, the feet would slide.
BACKWARD_LOSS = 0.5


@njit
def _pull_to_target(
    share: float, target_x: float, target_z: float, x: float, z: float
) -> tuple[float, float]:
    """What to add to the root's movement (x, z) in a frame to bring it nearer to the target movement.

    At right angles to the target, at most `share` times the movement's length is added. Along the target, the
    limit is PULL_AHEAD times as high. If the two directions shared one limit, a recorded clip that is too
    slow would use it up, and the character would drift off its path. If the target is slower than STILL, it
    has no direction, and the first limit applies to everything.
    """
    most = share * np.sqrt(x * x + z * z)
    size = np.sqrt(target_x * target_x + target_z * target_z)
    ahead_x, ahead_z = (target_x / size, target_z / size) if size >= STILL else (0.0, 0.0)
    lack_x, lack_z = target_x - x, target_z - z
    along = lack_x * ahead_x + lack_z * ahead_z
    lack_x, lack_z = lack_x - along * ahead_x, lack_z - along * ahead_z  # what is left is across the target
    along = min(max(along, -PULL_AHEAD * most), PULL_AHEAD * most)
    across_share = min(1.0, most / max(np.sqrt(lack_x * lack_x + lack_z * lack_z), 1e-9))
    return along * ahead_x + across_share * lack_x, along * ahead_z + across_share * lack_z


@njit
def _remove_backward(
    loss: float, target_x: float, target_z: float, x: float, z: float
) -> tuple[float, float]:
    """The root's movement (x, z) after the share `loss` of its part against the target is removed.

    If the target is slower than STILL, the share `loss` of the whole movement is removed.
    """
    squared_speed = target_x * target_x + target_z * target_z
    if squared_speed < STILL * STILL:
        return (1.0 - loss) * x, (1.0 - loss) * z
    against = loss * min(0.0, x * target_x + z * target_z) / squared_speed
    return x - against * target_x, z - against * target_z


@njit
def advance(
    y: Any,
    columns: Any,
    target: Any,
    loss: float,
    recorded_poses: bool,
    pull: float,
    path: Trajectory,
    phase: Any,
) -> None:
    """Advance the trajectories and phases of C characters by one frame.

    The past is shifted by a frame. The root moves and turns, the future becomes the predicted one, and the
    phase changes, all as the network predicts. The network predicts the turn of the world seen from the root,
    so the root turns by the negative.
    y: (C, Y) prediction. columns: see `advance_columns`. target: (C, 2) target velocity, cm a frame.
    loss: the share of the movement against the target that is removed; 0 in the runtime of Holden et al.
    (2017). recorded_poses: whether the predicted poses are recorded frames. If not, movement and turn are
    scaled by (1 - stand)^.25, where stand is the present share of the gait "stand", and the phase changes
    more slowly. pull: largest change of the movement at right angles to the target, as a share of the
    movement's length; 0 for no change. Recorded frames need it, because clips have only some directions and
    speeds. The idea is the adjustment of Holden et al. (2020).
    path: the trajectories, see `hobble.runtime.trajectory.Trajectory`. phase: (C,). Both change in place.
    """
    position, direction, gait = path
    length = position.shape[1]
    middle = length // 2  # the present frame
    velocity_column, turn_column, change_column = columns[0], columns[1], columns[2]
    position_column, direction_column, future, step = columns[3], columns[4], columns[5], columns[6]
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
        vx, vz = y[c, velocity_column], y[c, velocity_column + 1]
        # From root coordinates to the world.
        x, z = moving * (vx * cos + vz * sin), moving * (vz * cos - vx * sin)
        x, z = _remove_backward(loss, target[c, 0], target[c, 1], x, z)
        more_x, more_z = _pull_to_target(pull, target[c, 0], target[c, 1], x, z)
        position[c, middle, 0] += x + more_x
        position[c, middle, 1] += z + more_z
        yaw -= moving * y[c, turn_column]
        sin, cos = np.sin(yaw), np.cos(yaw)
        direction[c, middle, 0], direction[c, middle, 1] = sin, cos
        for i in range(middle + 1, length):
            # Interpolate between the predicted samples k and k + 1; m is the weight of sample k + 1. Beyond
            # the last sample, extrapolate the line through the last two.
            place = (i - middle) / step
            k = min(int(place), future - 2)
            m = place - k
            p, d = position_column + k, direction_column + k
            x = (1 - m) * y[c, p] + m * y[c, p + 1]
            z = (1 - m) * y[c, p + future] + m * y[c, p + future + 1]
            position[c, i, 0] = position[c, middle, 0] + x * cos + z * sin
            position[c, i, 1] = position[c, middle, 1] + z * cos - x * sin
            x = (1 - m) * y[c, d] + m * y[c, d + 1]
            z = (1 - m) * y[c, d + future] + m * y[c, d + future + 1]
            norm = max(np.sqrt(x * x + z * z), 1e-6)
            direction[c, i, 0] = (x * cos + z * sin) / norm
            direction[c, i, 1] = (z * cos - x * sin) / norm
        change = phase_change(moving, y[c, change_column])
        phase[c] = phase[c] + change - np.floor(phase[c] + change)


def advance_columns(layout: RowLayout) -> np.ndarray:
    """The argument `columns` (7,) of `advance`.

    These are the first columns in Y of root velocity, turn, phase change, position and direction, then the
    number of future samples, and the number of frames from one sample to the next.
    """
    blocks = (
        layout.y_root_velocity, layout.y_turn, layout.y_phase_change, layout.y_position, layout.y_direction
    )  # fmt: skip
    return np.array([*(b.start for b in blocks), layout.future, layout.step], np.int64)
