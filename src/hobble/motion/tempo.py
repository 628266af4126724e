"""Estimates how many times too fast a clip plays, from the accelerations of its body.

Gravity sets how strongly a walking or running body accelerates: a walker falls forward over the standing foot
like an inverted pendulum, and a runner in the air falls freely. A clip with twice the true frame rate shows
four times these accelerations. Accelerations are smoothed over a part of a step, not over a fixed time, so
that the result does not depend on the frame rate.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hobble.core.clip import Clip
from hobble.core.quat import Array
from hobble.core.smooth import gaussian
from hobble.motion.balance import GRAVITY, centre_of_mass
from hobble.motion.body import SIDES
from hobble.motion.rig import leg_length
from hobble.motion.root import facing_directions

FEWEST = 3  # steps; with fewer, nothing is estimated
BRIEFEST = 4  # frames; shorter steps show no accelerations
# Frames in which the hips are slower than this share of their fast speed (80th percentile) belong to no step.
MOVES = 0.25
ALONE = 0.3  # a foot stands alone if its ball is slower than this share of the speed of the other ball
# A figure runs if the correlation of the height of its hips with the distance between its ankles is above
# this. In a run, the hips are lowest when they pass over the standing foot (Cavagna et al. 1977).
RUNS = 0.1
# The usual values of fields of `Accelerations` in clips that play at the right speed: LEVEL for the field
# `level` in walks and runs, WALK and RUN for other fields. The binary logarithm of a value is a + b s +
# c s^2, where s is the binary logarithm of the length of a step in leg lengths. The coefficients (a, b, c)
# are robust fits to 161 clips of CMU, Holden et al. (2017) and Ferre et al., and of the data sets `styles`
# and `patients` (config/datasets).
LEVEL = (-2.77, 0.83, 0.23)
WALK = {"pendulum": (-1.43, -0.72, -0.2), "vertical": (-2.59, 1.59, 0.59)}
RUN = {"pendulum": (-0.35, -0.35, -0.25), "falling": (-0.02, 0.21, -0.3)}
STEPS = (0.3, 2.0)  # leg lengths: shortest and longest step for which the fits hold


@dataclass(frozen=True)
class Accelerations:
    """The accelerations of a body's centre of mass, and what they depend on.

    level, vertical: root mean squares of the horizontal and of the vertical acceleration, in g. falling: the
    strongest downward acceleration (98th percentile), in g. pendulum: slope of the forward acceleration, in
    g, against the forward lean, which is how far the centre of mass is ahead of the standing foot, divided by
    its height above this foot. The slope of an inverted pendulum that stands on a point is 1. step: length of
    a step in leg lengths. runs: whether the figure runs.
    """

    level: float
    vertical: float
    falling: float
    pendulum: float
    step: float
    runs: bool


@dataclass(frozen=True)
class TooFast:
    """How many times too fast a clip plays, from three estimates.

    Values below 1 mean that it plays too slowly. least: the estimate nearest to 1, or 1 if some estimates are
    above 1 and others below. likely: the median of the estimates.
    """

    least: float
    likely: float


def times_too_fast(clip: Clip, steps: int, scale: float = 1.0) -> TooFast | None:
    """How many times too fast a clip plays. None if its accelerations cannot be measured.

    steps: the number of steps in the clip. scale: size of the clip's figure / size of the captured person.
    """
    accelerations = measure_accelerations(clip, steps, GRAVITY * scale)
    if accelerations is None:
        return None
    s = float(np.log2(np.clip(accelerations.step, *STEPS)))
    usual = {"level": LEVEL, **(RUN if accelerations.runs else WALK)}
    estimates = []
    for name, (a, b, c) in usual.items():
        value = np.log2(max(getattr(accelerations, name), 0.02))
        # Half the logarithm, because accelerations grow with the square of the speed.
        estimates.append(0.5 * (value - (a + b * s + c * s * s)))
    low, likely, high = sorted(estimates)
    least = low if low > 0 else min(high, 0.0)
    return TooFast(float(2.0**least), float(2.0**likely))


def measure_accelerations(clip: Clip, steps: int, gravity: float = GRAVITY) -> Accelerations | None:
    """Measure the accelerations in a clip. None if its steps are too few or too short.

    steps: the number of steps in the clip. gravity: the acceleration g for the size of the figure, cm / s2.
    """
    at = {role: clip.positions[:, clip.skeleton.role(role)] for role in clip.skeleton.roles}
    if steps < FEWEST or len(clip) < FEWEST * BRIEFEST:
        return None
    speed = np.linalg.norm(np.gradient(gaussian(at["hips"][:, [0, 2]], 2.0), axis=0), axis=-1)
    moves = speed > MOVES * np.percentile(speed, 80)
    step_frames = moves.sum() / steps
    if step_frames < BRIEFEST:
        return None
    centre = gaussian(centre_of_mass(at), step_frames / 12)
    acceleration = np.gradient(np.gradient(centre, axis=0), axis=0) * clip.fps**2 / gravity
    # At the ends of the clip, smoothed accelerations are unreliable.
    used, edge = moves.copy(), max(2, round(step_frames / 4))
    used[:edge] = used[-edge:] = False
    if not used.any():
        return None
    ahead = facing_directions(clip.skeleton, clip.positions, step_frames)
    values = acceleration[used]
    return Accelerations(
        level=float(np.sqrt(np.mean(np.sum(values[:, [0, 2]] ** 2, axis=-1)))),
        vertical=float(np.sqrt(np.mean(values[:, 1] ** 2))),
        falling=-float(np.percentile(values[:, 1], 2)),
        pendulum=_pendulum_slope(at, centre, acceleration, ahead, used, max(1, round(step_frames / 8))),
        step=float(speed[moves].sum() / steps / leg_length(clip.skeleton)),
        runs=_height_correlation(at, step_frames, used) > RUNS,
    )


def _pendulum_slope(
    at: dict[str, Array],
    centre: Array,
    acceleration: Array,
    ahead: Array,
    used: NDArray[np.bool_],
    reach: int,
) -> float:
    """The slope of forward acceleration against forward lean, while one foot stands alone.

    at: role -> (F, 3) positions. centre: (F, 3) centre of mass. acceleration: (F, 3) of `centre`, in g.
    ahead: (F, 3) facing directions. used: (F,) bool, the frames to use. reach: speeds are measured from
    this many frames before a frame to this many after it.
    """
    balls = [_distance_moved(at[f"{side}_toe"], reach) for side in SIDES]
    # The zeros do not change the slope. With them, it is 0 if no foot ever stands alone.
    leans, accelerations = [np.zeros(1)], [np.zeros(1)]
    for k, side in enumerate(SIDES):
        alone = used & (balls[k] < ALONE * balls[1 - k])
        if alone.any():
            # The foot presses on the ground at .6 of the way from ankle to ball.
            arm = centre - (0.4 * at[f"{side}_heel"] + 0.6 * at[f"{side}_toe"])
            lean = np.sum(arm / np.maximum(arm[:, 1:2], 1.0) * ahead, axis=-1)[alone]
            forward = np.sum(acceleration * ahead, axis=-1)[alone]
            leans.append(lean - lean.mean())
            accelerations.append(forward - forward.mean())
    lean, forward = np.concatenate(leans), np.concatenate(accelerations)
    return float(lean @ forward / max(float(lean @ lean), 1e-9))


def _distance_moved(point: Array, reach: int) -> Array:
    """(F,) distance that a point (F, 3) moves from `reach` frames before a frame to `reach` frames after it.

    It is 0 in the first and last `reach` frames.
    """
    out = np.zeros(len(point))
    if len(point) > 2 * reach:
        out[reach:-reach] = np.linalg.norm(point[2 * reach :] - point[: -2 * reach], axis=-1)
    return out


def _height_correlation(at: dict[str, Array], step_frames: float, used: NDArray[np.bool_]) -> float:
    """Correlation of the height of the hips with the distance between the ankles.

    at: role -> (F, 3) positions. step_frames: number of frames in a step. used: (F,) bool, the frames to use.
    """
    height = gaussian(at["hips"][:, 1], step_frames / 16)
    distance = np.linalg.norm((at["left_heel"] - at["right_heel"])[:, [0, 2]], axis=-1)
    # Only changes within a step count, so slower changes are subtracted.
    height, distance = (values - gaussian(values, step_frames / 2) for values in (height, distance))
    height, distance = height[used], distance[used]
    return float(height @ distance / np.sqrt((height @ height) * (distance @ distance) + 1e-9))
