"""The character's trajectory on the ground, and how the target bends it.

A trajectory has one entry per frame, half of them past and half future. The first axis of every array is the
C characters. Angles are yaw: 0 faces +Z, and they grow toward +X (left). The formulas are those of the
runtime of Holden et al. (2017).
"""

from typing import Any

import numpy as np
from numba.extending import register_jitable

from hobble.core.compiled import njit

# Largest correction of the target velocity, as a multiple of the target. With 1, a network that saw few
# starts of a walk in training stands for seconds before it walks.
STEERING_LIMIT = 2.0
TARGET_MIX = 0.9  # each frame, this share of the remaining difference to the target is removed
GAIT_MIX = 0.1  # the same for the shares of the gaits
# Gain, per frame, with which the velocity error is integrated. A steady error is corrected within a second or
# two.
CORRECTION_RATE = 0.01
# Largest velocity error that is integrated, as a share of the target speed. While the error is larger, the
# character is still turning or starting.
CORRECTION_WITHIN = 0.8
MOST_CORRECTION = 1.0  # largest integral correction, as a share of the target velocity
# Largest turn to ask the network for, radians. If asked for more, the character may turn the other way.
FURTHEST_TURN = np.radians(137)
STRAFE_FROM = np.radians(45)  # the strafe share is 1 if facing and velocity are at least this far apart
STILL = 0.1  # cm a frame: a slower target means standing
CARRIED_SHARE = 0.5  # weight of `carried` and of `predicted` in a joint's new position
STANDING_SHARE = 0.1  # share of the predicted change of phase that is applied to a standing character


# Groups of arrays for compiled functions, which unpack them into names. They are plain tuples, because
# passing a named tuple costs a microsecond.
#
# position, direction (C, T, 2): world x and z. gait (C, T, 6): shares of the gaits. By default T is 120: 60
# frames of the past, then the present (entry T/2) and the 59 frames after it.
Trajectory = tuple[Any, Any, Any]
# What the caller wants: velocity, direction (C, 2), the facing; strafe (C,), the strafe share; gait (C, 6),
# shares of the gaits. The strafe share rises with the angle between facing and velocity, from 0 to 1.
Target = tuple[Any, Any, Any, Any]
# The smoothed target: velocity, direction (C, 2); strafe (C,). correction (C, 2): what corrects a steady
# error of the velocity; earlier (C, 2): the mean target velocity of the last frames; see `_ask_velocity`.
Smoothed = tuple[Any, Any, Any, Any, Any]
# values, targets (C, K): present and target values of all channels' columns. steps (K,): largest change of a
# value in a frame.
Channels = tuple[Any, Any, Any]


# How a network's prediction changes the character's state, as in the runtime of Holden et al. (2017). These
# functions take numbers, numpy arrays or tensors: compiled functions, roll-outs and training call them. The
# only other implementation is in C.


@register_jitable
def joint_place(carried: Any, predicted: Any) -> Any:
    """New joint positions: the mean of `carried` (old position plus velocity) and `predicted`."""
    return CARRIED_SHARE * (carried + predicted)


@register_jitable
def movement_share(stand: Any) -> Any:
    """The share (0 to 1) of the root's predicted movement that is applied. It is 0 for a standing character.

    stand: share of the gait "stand". At 0.9375, half of the movement is still applied.
    """
    return np.maximum(0.0, 1.0 - stand) ** 0.25


@register_jitable
def phase_change(share: Any, predicted: Any) -> Any:
    """The change of phase that is applied, cycles.

    share: from `movement_share`. predicted: the change that the network predicts, cycles.
    """
    return ((1.0 - STANDING_SHARE) * share + STANDING_SHARE) * predicted


@njit
def wrap(angle: float) -> float:
    """The angle in -pi..pi."""
    return angle - 2 * np.pi * np.floor((angle + np.pi) / (2 * np.pi))


@njit
def target_facing(velocity: Any, ahead: Any, direction: Any, strafe: Any, look: Any) -> None:
    """Write the strafe share into `strafe` (C,) and the target facing into `look` (C, 2).

    velocity: (C, 2) target velocity. ahead: (C, 2) direction in which the caller wants the character to look;
    zero if the character is to look where it goes. direction: (C, 2) smoothed facing. A standing character
    keeps it if `ahead` is zero. With another `ahead`, a standing character has the strafe share 1.
    """
    for c in range(velocity.shape[0]):
        x, z = velocity[c, 0], velocity[c, 1]
        going = np.sqrt(x * x + z * z) >= STILL
        if ahead[c, 0] == 0.0 and ahead[c, 1] == 0.0:
            strafe[c] = 0.0
            look[c, 0] = x if going else direction[c, 0]
            look[c, 1] = z if going else direction[c, 1]
        else:
            aside = abs(wrap(np.arctan2(x, z) - np.arctan2(ahead[c, 0], ahead[c, 1])))
            strafe[c] = min(1.0, aside / STRAFE_FROM) if going else 1.0
            look[c, 0], look[c, 1] = ahead[c, 0], ahead[c, 1]


@njit
def follow_target(target: Target, steering: float, smoothed: Smoothed, path: Trajectory) -> None:
    """Move `smoothed` toward the caller's target, and the gait of the present frame toward the target gait.

    Before that, the target is corrected, see `_ask_velocity`. With `steering` 0 there is no correction,
    as in the runtime of Holden et al. (2017).
    """
    target_velocity, target_direction, target_strafe, target_gait = target
    velocity, direction, strafe, correction, earlier = smoothed
    position, heading, gait = path
    middle = gait.shape[1] // 2
    for c in range(velocity.shape[0]):
        x, z = target_velocity[c, 0], target_velocity[c, 1]
        goal_yaw = np.arctan2(target_direction[c, 0], target_direction[c, 1])
        if steering > 0.0:
            if x * x + z * z >= STILL * STILL:
                facing = np.arctan2(heading[c, middle, 0], heading[c, middle, 1])
                turn = wrap(goal_yaw - facing)
                # Ask for more than the remaining turn, but not for so much that the network turns around.
                room = max(FURTHEST_TURN - abs(turn), 0.0)
                goal_yaw += min(max(0.5 * steering * turn, -room), room)
            x, z = _ask_velocity(steering, x, z, position[c], correction[c], earlier[c])
        velocity[c, 0] += TARGET_MIX * (x - velocity[c, 0])
        velocity[c, 1] += TARGET_MIX * (z - velocity[c, 1])
        yaw = np.arctan2(direction[c, 0], direction[c, 1])
        yaw += TARGET_MIX * wrap(goal_yaw - yaw)
        direction[c, 0], direction[c, 1] = np.sin(yaw), np.cos(yaw)
        strafe[c] += TARGET_MIX * (target_strafe[c] - strafe[c])
        for k in range(gait.shape[2]):
            gait[c, middle, k] += GAIT_MIX * (target_gait[c, k] - gait[c, middle, k])


@njit
def _ask_velocity(
    steering: float, x: float, z: float, position: Any, correction: Any, earlier: Any
) -> tuple[float, float]:
    """The velocity to ask the network for, so that the character reaches the velocity (x, z).

    A network tends to keep its past velocity. So a correction is added to the target, at most STEERING_LIMIT
    times the target. One part is `steering` times the error, which is the target minus the mean velocity over
    the later half of the past. The other part, `correction` (2,), is for a steady error, such as weaker
    strafing to one side. It is the integral of the error along the target velocity and to its left, as shares
    of the target speed. The mean velocity is that of some frames ago, so this error is measured from
    `earlier` (2,), the target of the same time. Measured from the present target, a character that follows a
    circle seems to turn too late, and the integral makes it turn ever earlier. position: (T, 2) of the
    trajectory.
    """
    middle = position.shape[0] // 2
    span = middle // 2
    speed = np.sqrt(x * x + z * z)
    lack_x = x - (position[middle, 0] - position[middle - span, 0]) / span
    lack_z = z - (position[middle, 1] - position[middle - span, 1]) / span
    more_x, more_z = steering * lack_x, steering * lack_z
    # A mean with weights that fall exponentially. Its mean age is that of the mean velocity.
    earlier[0] += (x - earlier[0]) / ((span + 1) / 2)
    earlier[1] += (z - earlier[1]) / ((span + 1) / 2)
    lack_x += earlier[0] - x
    lack_z += earlier[1] - z
    if speed < STILL:
        correction[:] = 0.0
    else:
        more_x += correction[0] * x + correction[1] * z
        more_z += correction[0] * z - correction[1] * x
        # Do not integrate while the character turns or starts: that error goes away by itself.
        if lack_x * lack_x + lack_z * lack_z < (CORRECTION_WITHIN * speed) ** 2:
            rate = steering * CORRECTION_RATE / (speed * speed)
            correction[0] += rate * (lack_x * x + lack_z * z)
            correction[1] += rate * (lack_x * z - lack_z * x)
            for k in range(2):
                correction[k] = min(max(correction[k], -MOST_CORRECTION), MOST_CORRECTION)
    limit = STEERING_LIMIT * speed / max(np.sqrt(more_x * more_x + more_z * more_z), 1e-6)
    return x + more_x * min(1.0, limit), z + more_z * min(1.0, limit)


@njit
def blend_future(smoothed: Smoothed, path: Trajectory) -> None:
    """Bend the predicted future toward the target velocity and facing, more at later times.

    At time t of the future (0 to 1), the share of the target is 1 - (1 - t)^b. b is .5 for the position (1
    when strafing) and 2 for the direction (.5 when strafing). The gait of the future is the present gait.
    """
    velocity, facing, strafe, _, _ = smoothed
    position, direction, gait = path
    length = position.shape[1]
    middle = length // 2
    shares = np.empty((2, length))  # of the target, for the position and for the direction
    for c in range(position.shape[0]):
        # Powers take half of the time of this function. Most characters of a crowd have the same strafe share
        # (0) as the one before, so that its powers can be used again.
        if c == 0 or strafe[c] != strafe[c - 1]:
            for i in range(middle + 1, length):
                remaining = 1.0 - (i - middle) / middle
                shares[0, i] = 1.0 - remaining ** (0.5 + 0.5 * strafe[c])
                shares[1, i] = 1.0 - remaining ** (2.0 - 1.5 * strafe[c])
        goal_yaw = np.arctan2(facing[c, 0], facing[c, 1])
        old_x, old_z = position[c, middle]
        for i in range(middle + 1, length):
            step_x, step_z = position[c, i, 0] - old_x, position[c, i, 1] - old_z
            old_x, old_z = position[c, i]
            position[c, i, 0] = position[c, i - 1, 0] + step_x + shares[0, i] * (velocity[c, 0] - step_x)
            position[c, i, 1] = position[c, i - 1, 1] + step_z + shares[0, i] * (velocity[c, 1] - step_z)
            yaw = np.arctan2(direction[c, i, 0], direction[c, i, 1])
            yaw += shares[1, i] * wrap(goal_yaw - yaw)
            direction[c, i, 0], direction[c, i, 1] = np.sin(yaw), np.cos(yaw)
            for k in range(gait.shape[2]):
                gait[c, i, k] = gait[c, middle, k]


@njit
def sample_points(path: Trajectory, step: int, side: float, points: Any) -> None:
    """Write the points (C, samples, 3, 2) where the ground is looked up: left, on the path, right.

    step: frames between two samples. side: cm from the path to the points at its sides.
    """
    position, direction, _ = path
    for c in range(points.shape[0]):
        for s in range(points.shape[1]):
            x, z = position[c, s * step]
            dx, dz = direction[c, s * step]
            points[c, s, 0, 0], points[c, s, 0, 1] = x + side * dz, z - side * dx
            points[c, s, 1, 0], points[c, s, 1, 1] = x, z
            points[c, s, 2, 0], points[c, s, 2, 1] = x - side * dz, z + side * dx


@njit
def write_mean_height(ground: Any, height: Any) -> None:
    """Write the mean ground height on the path into height (C,).

    ground: (C, samples, 3) heights left of the path, on it and right of it.
    """
    for c in range(ground.shape[0]):
        total = 0.0
        for s in range(ground.shape[1]):
            total += ground[c, s, 1]
        height[c] = total / ground.shape[1]


@njit
def prepare(
    target: Target,
    steering: float,
    smoothed: Smoothed,
    path: Trajectory,
    channels: Channels,
    step: int,
    side: float,
    points: Any,
) -> None:
    """Call `follow_target`, `blend_future` and `sample_points`, and move channel values to their targets.

    All these functions are in this file because numba compiles a cached function again only if its own file
    changes, not if the file of a function that it calls changes.
    """
    follow_target(target, steering, smoothed, path)
    blend_future(smoothed, path)
    sample_points(path, step, side, points)
    values, targets, steps = channels
    for c in range(values.shape[0]):
        for k in range(values.shape[1]):
            change = targets[c, k] - values[c, k]
            values[c, k] += min(max(change, -steps[k]), steps[k])
