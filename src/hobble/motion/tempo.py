"""Estimates how many times too fast a clip plays, from the accelerations of its body.

Gravity sets how strongly a walking or running body accelerates: a walker falls forward over the standing foot
like an inverted pendulum, and a runner in the air falls freely. A clip with twice the true frame rate shows
four times these accelerations. All windows are shares of a step, so they do not depend on the frame rate.
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
from hobble.motion.root import facing

FEWEST = 3  # steps; with fewer, nothing is estimated
BRIEFEST = 4  # frames a step; with fewer, a step shows no accelerations
MOVES = 0.25  # share of a brisk speed of the clip: slower frames belong to no step
ALONE = 0.3  # a foot stands alone if its ball is slower than this share of the speed of the other ball
# Correlation of the height of the hips with the distance between the ankles. If it is higher, the figure
# runs: its hips are lowest over the standing foot (Cavagna et al. 1977).
RUNS = 0.1
# Binary logarithms of accelerations, in g, as a + b s + c s^2, where s is the binary logarithm of the length
# of a step in leg lengths. Robust fits to 161 clips of CMU, styles, patients, Ferre et al. and the original
# release.
LEVEL = (-2.77, 0.83, 0.23)
WALK = {"pendulum": (-1.43, -0.72, -0.2), "vertical": (-2.59, 1.59, 0.59)}
RUN = {"pendulum": (-0.35, -0.35, -0.25), "falling": (-0.02, 0.21, -0.3)}
STEPS = (0.3, 2.0)  # leg lengths; the fits hold for steps of this length


@dataclass(frozen=True)
class Accelerations:
    """The accelerations of a body's centre of mass, and what they depend on.

    level, vertical: root mean squares, in g. falling: the strongest downward one (98th percentile), in g.
    pendulum: how much the forward acceleration grows, in g, as the centre of mass moves forward over the
    standing foot by as much as it is above it; 1 for a pendulum on a point. step: length of a step in leg
    lengths. runs: whether the figure runs.
    """

    level: float
    vertical: float
    falling: float
    pendulum: float
    step: float
    runs: bool


@dataclass(frozen=True)
class TooFast:
    """How many times too fast a clip plays. least: the estimate nearest to 1; 1 if the estimates disagree on
    whether it is too fast or too slow. likely: the median of the estimates.
    """

    least: float
    likely: float


def too_fast(clip: Clip, steps: int, scale: float = 1.0) -> TooFast | None:
    """How many times too fast a clip plays, by each of three accelerations. None if they cannot be measured.

    steps: how many the clip has. scale: size of the clip's figure / size of the captured one.
    """
    found = accelerations(clip, steps, GRAVITY * scale)
    if found is None:
        return None
    s = float(np.log2(np.clip(found.step, *STEPS)))
    usual = {"level": LEVEL, **(RUN if found.runs else WALK)}
    estimates = []
    for name, (a, b, c) in usual.items():
        measured = np.log2(max(getattr(found, name), 0.02))
        estimates.append(0.5 * (measured - (a + b * s + c * s * s)))
    low, likely, high = sorted(estimates)
    return TooFast(float(2.0 ** (low if low > 0 else min(high, 0.0))), float(2.0**likely))


def accelerations(clip: Clip, steps: int, gravity: float = GRAVITY) -> Accelerations | None:
    """Measure a clip of so many steps. None if the steps are too few or too short. gravity: g in cm / s2."""
    at = {role: clip.positions[:, clip.skeleton.role(role)] for role in clip.skeleton.roles}
    if steps < FEWEST or len(clip) < FEWEST * BRIEFEST:
        return None
    speed = np.linalg.norm(np.gradient(gaussian(at["hips"][:, [0, 2]], 2.0), axis=0), axis=-1)
    moves = speed > MOVES * np.percentile(speed, 80)
    frames = moves.sum() / steps  # of a step
    if frames < BRIEFEST:
        return None
    centre = gaussian(centre_of_mass(at), frames / 12)
    pull = np.gradient(np.gradient(centre, axis=0), axis=0) * clip.fps**2 / gravity
    inner, edge = moves.copy(), max(2, round(frames / 4))
    inner[:edge] = inner[-edge:] = False
    if not inner.any():
        return None
    ahead = facing(clip.skeleton, clip.positions, frames)
    pull_inside = pull[inner]
    return Accelerations(
        level=float(np.sqrt(np.mean(np.sum(pull_inside[:, [0, 2]] ** 2, axis=-1)))),
        vertical=float(np.sqrt(np.mean(pull_inside[:, 1] ** 2))),
        falling=-float(np.percentile(pull_inside[:, 1], 2)),
        pendulum=_pendulum(at, centre, pull, ahead, inner, max(1, round(frames / 8))),
        step=float(speed[moves].sum() / steps / leg_length(clip.skeleton)),
        runs=_spring(at, frames, inner) > RUNS,
    )


def _pendulum(
    at: dict[str, Array],
    centre: Array,
    pull: Array,
    ahead: Array,
    inner: NDArray[np.bool_],
    reach: int,
) -> float:
    """The slope of the forward acceleration against the forward lean over the foot that stands alone.

    pull: (F, 3) accelerations in g. inner: (F,) the frames to use. reach: frames before and after over which
    speeds are measured.
    """
    balls = [_way(at[f"{side}_toe"], reach) for side in SIDES]
    leans, pulls = [np.zeros(1)], [np.zeros(1)]
    for k, side in enumerate(SIDES):
        alone = inner & (balls[k] < ALONE * balls[1 - k])
        if alone.any():
            arm = centre - (0.4 * at[f"{side}_heel"] + 0.6 * at[f"{side}_toe"])
            lean = np.sum(arm / np.maximum(arm[:, 1:2], 1.0) * ahead, axis=-1)[alone]
            own = np.sum(pull * ahead, axis=-1)[alone]
            leans.append(lean - lean.mean())
            pulls.append(own - own.mean())
    lean, own = np.concatenate(leans), np.concatenate(pulls)
    return float(lean @ own / max(float(lean @ lean), 1e-9))


def _way(place: Array, reach: int) -> Array:
    """(F,) distance between where a point (F, 3) is `reach` frames before and after; 0 at the ends."""
    out = np.zeros(len(place))
    if len(place) > 2 * reach:
        out[reach:-reach] = np.linalg.norm(place[2 * reach :] - place[: -2 * reach], axis=-1)
    return out


def _spring(at: dict[str, Array], frames: float, inner: NDArray[np.bool_]) -> float:
    """Correlation of the height of the hips with the distance between the ankles. frames: of a step."""
    height = gaussian(at["hips"][:, 1], frames / 16)
    apart = np.linalg.norm((at["left_heel"] - at["right_heel"])[:, [0, 2]], axis=-1)
    height, apart = (values - gaussian(values, frames / 2) for values in (height, apart))
    height, apart = height[inner], apart[inner]
    return float(height @ apart / np.sqrt((height @ height) * (apart @ apart) + 1e-9))
