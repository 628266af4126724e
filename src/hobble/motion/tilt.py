"""Recognises a file with a tilted world, by the ground under the feet and by the lean of the body.

In a tilted world both are tilted alike. On a real slope the ground is tilted and the body is not.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.orient import unit
from hobble.motion.rig import leg_length

LEAST = 6.0  # degrees; a smaller tilt cannot be distinguished from errors of the fitted ground
AGREE = 0.6  # body and ground agree if they differ by less than this share of the tilt
EVEN = 2.5  # cm; if the median distance of standing feet from the fitted plane is larger, they show no plane
# If trunk, legs and the line across the body all lean to the same side by more degrees, the world is tilted.
# In 172 clips of CMU, styles, patients, Ferre et al. and the original release it is 7.5 at most, with a hurt
# leg.
ASIDE = 8.0
LEAN = 4.0  # degrees: how far a walking body leans forward
# The spread of feet along an axis of the ground is their standard deviation in leg lengths. The slope along
# axes with a spread above WIDE is tried first, then along those above NARROW. With less spread no slope
# shows.
WIDE = 0.4
NARROW = 0.05
SLOW = 0.3  # leg lengths a second; the ball of a standing foot is slower
FEWEST = 10  # fewest positions of standing feet
FITS = 12  # rounds of fitting the ground, which minimise the sum of distances


def tilt(clip: Clip) -> float | None:
    """Degrees by which the world is tilted, or None if nothing shows a tilt."""
    p, leg = clip.positions, leg_length(clip.skeleton)
    aside, level = _aside(clip.skeleton, p), False
    feet = standing_balls(clip)
    if len(feet) >= FEWEST:
        level_part = feet[:, [0, 2]] - feet[:, [0, 2]].mean(axis=0)
        spread, axes = np.linalg.eigh(np.cov(level_part.T))
        slope, off = _plane(level_part @ axes, feet[:, 1])
        ground, body = -slope / np.sqrt(1 + slope @ slope), _leaning(clip.skeleton, p) @ axes
        wide = np.sqrt(np.maximum(spread, 0.0))
        for used in (wide > WIDE * leg, wide > NARROW * leg):
            size = float(np.linalg.norm(ground[used]))
            apart = float(np.linalg.norm((body - ground)[used]))
            if off < EVEN and size > np.sin(np.radians(LEAST)) and apart < AGREE * size:
                return float(np.degrees(np.arcsin(min(size, 1.0))))
        level = bool((wide > WIDE * leg).all() and np.linalg.norm(ground) < np.sin(np.radians(LEAST / 2)))
    return aside if aside > ASIDE and not level else None


def check_tilt(path: Path, clip: Clip, leave: bool) -> None:
    """Raise InputError if the world is tilted. leave: accept any tilt."""
    found = None if leave else tilt(clip)
    if found is not None:
        raise InputError(
            path,
            f"the ground under the feet or the body is tilted by {found:.0f} degrees: the world seems tilted",
            fix="Level the floor where the clip comes from and export it again. If the figure really leans "
            "that far, set motion.defects: leave.",
        )


def standing_balls(clip: Clip) -> Array:
    """Positions (N, 3) of the balls of both feet where they stand."""
    p, role, leg = clip.positions, clip.skeleton.role, leg_length(clip.skeleton)
    balls = np.stack([p[:, role(f"{side}_toe")] for side in ("left", "right")], axis=1)
    k = max(1, round(clip.fps / 20))
    speed = np.linalg.norm(balls[2 * k :] - balls[: -2 * k], axis=-1) * clip.fps / (2 * k)
    return np.asarray(balls[k : len(balls) - k][speed < SLOW * leg])


def _plane(level: Array, height: Array) -> tuple[Array, float]:
    """Slope (2,) of the plane through points, and their median distance from it, cm.

    level: (N, 2) positions on the ground, cm. height: (N,) cm.
    """
    points = np.column_stack([level, np.ones(len(level))])
    weight = np.ones(len(level))
    for _ in range(FITS):
        fit = np.linalg.lstsq(points * weight[:, None], height * weight, rcond=None)[0]
        off = np.abs(height - points @ fit)
        weight = 1.0 / np.sqrt(np.maximum(off, 0.3))
    return fit[:2], float(np.median(off))


def _parts(skeleton: Skeleton, p: Array) -> tuple[Array, Array, Array]:
    """Unit vectors (F, 3) along the trunk and along the legs, upward, and from right to left."""
    at = {role: p[:, skeleton.role(role)] for role in skeleton.roles}
    across = at["left_hip"] - at["right_hip"] + at["left_shoulder"] - at["right_shoulder"]
    legs = at["hips"] - 0.5 * (at["left_heel"] + at["right_heel"])
    return unit(at["head"] - at["hips"]), unit(legs), unit(across)


def _leaning(skeleton: Skeleton, p: Array) -> Array:
    """(2,) x and z of the mean unit vector up the body, without the forward lean of a walk."""
    trunk, legs, across = _parts(skeleton, p)
    ahead = unit(np.cross(across, [0.0, 1.0, 0.0]))
    return np.asarray((unit(trunk + legs) - np.sin(np.radians(LEAN)) * ahead)[:, [0, 2]].mean(axis=0))


def _aside(skeleton: Skeleton, p: Array) -> float:
    """Degrees by which trunk, legs and the line across the body lean to the same side; 0 if they differ."""
    trunk, legs, across = _parts(skeleton, p)
    left = unit(across * [1.0, 0.0, 1.0])
    leans = [float(np.mean(np.sum(part * left, axis=-1))) for part in (trunk, legs)]
    leans.append(-float(np.mean(across[:, 1])))
    same = min(leans) > 0 or max(leans) < 0
    return float(np.degrees(np.arcsin(min(abs(lean) for lean in leans)))) if same else 0.0
