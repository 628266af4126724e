"""Finds a world that is tilted against its figure, by the ground under the feet and by which way is down.

Both show the tilt. On a real slope the ground is tilted, and the body still balances along Y.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.balance import Balance, balance
from hobble.motion.orient import unit
from hobble.motion.rig import leg_length

# Degrees: least tilt that is found. Flat ground is at most 1.2 degrees off in 172 clips of CMU, styles,
# patients, Ferre et al. and the original release, along axes where the feet spread widely. Along others the
# fit of the ground is worse, and LEAST_NARROW takes the place of LEAST.
LEAST, LEAST_NARROW = 4.0, 6.0
AGREE = 0.6  # body and ground agree if they differ by less than this share of the tilt
EVEN = 2.5  # cm; if the median distance of standing feet from the fitted plane is larger, they show no plane
UNEVEN = 4.0  # cm; for tilts below LEAST_NARROW, the same for the 90th percentile of these distances
# Degrees to the side by which a body balances off Y. In the 172 clips it is 3.9 at most if each foot stands
# alone for LONG seconds, and 6 in shorter clips.
BALANCED, BALANCED_SHORT, LONG = 5.0, 9.0, 0.2
# If balance does not show the tilt, the world is tilted if trunk, legs and the line across the body all lean
# to the same side by more degrees than this. In the 172 clips it is 7.5 at most, with a hurt leg.
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


def world_tilt(clip: Clip) -> float | None:
    """Degrees by which the world is tilted, or None if nothing shows a tilt."""
    p, leg = clip.positions, leg_length(clip.skeleton)
    body, level = balance(clip), False
    up = _leaning(clip.skeleton, p) if body is None else body.up
    feet = standing_balls(clip)
    if len(feet) >= FEWEST:
        level_part = feet[:, [0, 2]] - feet[:, [0, 2]].mean(axis=0)
        spread, axes = np.linalg.eigh(np.cov(level_part.T))
        slope, off = _plane(level_part @ axes, feet[:, 1])
        ground, lean = -slope / np.sqrt(1 + slope @ slope), up @ axes
        wide = np.sqrt(np.maximum(spread, 0.0))
        even = off[0] < EVEN
        least = LEAST if body is not None and off[1] < UNEVEN else LEAST_NARROW
        for used, smallest in ((wide > WIDE * leg, least), (wide > NARROW * leg, LEAST_NARROW)):
            size = float(np.linalg.norm(ground[used]))
            apart = float(np.linalg.norm((lean - ground)[used]))
            if even and size > np.sin(np.radians(smallest)) and apart < AGREE * size:
                return float(np.degrees(np.arcsin(min(size, 1.0))))
        level = bool((wide > WIDE * leg).all() and np.linalg.norm(ground) < np.sin(np.radians(LEAST)))
    return None if level else _sideways(clip, body)


def _sideways(clip: Clip, body: Balance | None) -> float | None:
    """Degrees by which a body that balances or leans to one side shows a tilt, or None."""
    if body is not None:
        most = np.interp(body.seconds, [0.0, LONG], [BALANCED_SHORT, BALANCED])
        if abs(body.aside) > most:
            return abs(body.aside)
        if body.seconds >= LONG:
            return None
    aside = _aside(clip.skeleton, clip.positions)
    return aside if aside > ASIDE else None


def check_tilt(path: Path, clip: Clip, leave: bool) -> None:
    """Raise InputError if the world is tilted. leave: accept any tilt."""
    found = None if leave else world_tilt(clip)
    if found is not None:
        raise InputError(
            path,
            f"the ground under the feet or the body is tilted by {found:.0f} degrees: the world seems tilted",
            fix="Level the floor where the clip comes from and export it again. If the figure walked on a "
            "slope or really leans that far, set motion.defects: leave.",
        )


def standing_balls(clip: Clip) -> Array:
    """Positions (N, 3) of the balls of both feet where they stand."""
    p, role, leg = clip.positions, clip.skeleton.role, leg_length(clip.skeleton)
    balls = np.stack([p[:, role(f"{side}_toe")] for side in ("left", "right")], axis=1)
    k = max(1, round(clip.fps / 20))
    speed = np.linalg.norm(balls[2 * k :] - balls[: -2 * k], axis=-1) * clip.fps / (2 * k)
    return np.asarray(balls[k : len(balls) - k][speed < SLOW * leg])


def _plane(level: Array, height: Array) -> tuple[Array, Array]:
    """Slope (2,) of the plane through points; median and 90th percentile (2,) of their distances from it, cm.

    level: (N, 2) positions on the ground, cm. height: (N,) cm.
    """
    points = np.column_stack([level, np.ones(len(level))])
    weight = np.ones(len(level))
    for _ in range(FITS):
        fit = np.linalg.lstsq(points * weight[:, None], height * weight, rcond=None)[0]
        off = np.abs(height - points @ fit)
        weight = 1.0 / np.sqrt(np.maximum(off, 0.3))
    return fit[:2], np.percentile(off, [50, 90])


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
