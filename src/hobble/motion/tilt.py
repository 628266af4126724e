"""Finds a clip whose Y axis is not vertical: its whole world is tilted.

In a tilted world, both the ground under the feet and the direction in which the body balances are off. On a
real slope only the ground is tilted; the body still balances along Y.
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

# Degrees: smaller tilts are ignored. LEAST is for axes of the ground along which the feet spread widely.
# Along these, flat ground seems tilted by at most 1.2 degrees in 172 clips of CMU, Holden et al. (2017) and
# Ferre et al., and of the data sets `styles` and `patients` (config/datasets). LEAST_NARROW is for axes with
# less spread, and for clips that show the ground or the balance of the body less well.
LEAST, LEAST_NARROW = 4.0, 6.0
AGREE = 0.6  # body and ground show the same tilt if they differ by less than this share of it
EVEN = 2.5  # cm; if the median distance of standing feet from the fitted plane is larger, no slope is used
UNEVEN = 4.0  # cm; if the 90th percentile of these distances is larger, tilts below LEAST_NARROW are ignored
# Degrees by which the direction in which a body balances may lean to one side of Y. The limit is BALANCED if
# each foot stands alone for at least LONG seconds; it rises to BALANCED_SHORT as this time goes to 0. In the
# 172 clips the direction leans by at most 3.9 degrees if the time is at least LONG, and else by at most 6.
BALANCED, BALANCED_SHORT, LONG = 5.0, 9.0, 0.2
# Degrees. If a foot stands alone too briefly to judge the balance, the world counts as tilted if trunk, legs
# and the line across the body all lean to the same side by more than this. In the 172 clips the least of the
# three leans is at most 7.5, in a walk with a hurt leg.
ASIDE = 8.0
LEAN = 4.0  # degrees by which a walking body usually leans forward
# The spread of feet along an axis of the ground is their standard deviation in leg lengths. The slope along
# axes with a spread above WIDE is tried first, then along those above NARROW. With less spread no slope
# shows.
WIDE = 0.4
NARROW = 0.05
SLOW = 0.3  # leg lengths a second; the ball of a standing foot is slower
FEWEST = 10  # with fewer positions of standing feet, no ground is fitted
FITS = 12  # reweighted least-squares fits, which together minimise the sum of distances from the ground


def world_tilt(clip: Clip) -> float | None:
    """Degrees by which the world is tilted, or None if nothing shows a tilt."""
    p, leg = clip.positions, leg_length(clip.skeleton)
    body, flat = balance(clip), False
    up = _leaning(clip.skeleton, p) if body is None else body.up
    feet = standing_balls(clip)
    if len(feet) >= FEWEST:
        on_ground = feet[:, [0, 2]] - feet[:, [0, 2]].mean(axis=0)
        spread, axes = np.linalg.eigh(np.cov(on_ground.T))
        slope, off = _plane(on_ground @ axes, feet[:, 1])
        ground, lean = -slope / np.sqrt(1 + slope @ slope), up @ axes
        wide = np.sqrt(np.maximum(spread, 0.0))
        even = off[0] < EVEN
        least = LEAST if body is not None and off[1] < UNEVEN else LEAST_NARROW
        for used, smallest in ((wide > WIDE * leg, least), (wide > NARROW * leg, LEAST_NARROW)):
            size = float(np.linalg.norm(ground[used]))
            apart = float(np.linalg.norm((lean - ground)[used]))
            if even and size > np.sin(np.radians(smallest)) and apart < AGREE * size:
                return float(np.degrees(np.arcsin(min(size, 1.0))))
        flat = bool((wide > WIDE * leg).all() and np.linalg.norm(ground) < np.sin(np.radians(LEAST)))
    return None if flat else _sideways(clip, body)


def _sideways(clip: Clip, body: Balance | None) -> float | None:
    """Degrees by which a body balances or leans to one side, or None if not by enough to show a tilt."""
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
    tilt = None if leave else world_tilt(clip)
    if tilt is not None:
        raise InputError(
            path,
            f"the ground or the body is tilted by {tilt:.0f} degrees, so the whole world seems tilted",
            fix="Level the floor where the clip comes from and export it again. If the figure walked on a "
            "slope or really leans that far, set motion.defects: leave.",
        )


def standing_balls(clip: Clip) -> Array:
    """Positions (N, 3) of the balls of both feet, in the frames in which each of them stands."""
    p, role, leg = clip.positions, clip.skeleton.role, leg_length(clip.skeleton)
    balls = np.stack([p[:, role(f"{side}_toe")] for side in ("left", "right")], axis=1)
    k = max(1, round(clip.fps / 20))
    speed = np.linalg.norm(balls[2 * k :] - balls[: -2 * k], axis=-1) * clip.fps / (2 * k)
    return np.asarray(balls[k : len(balls) - k][speed < SLOW * leg])


def _plane(on_ground: Array, height: Array) -> tuple[Array, Array]:
    """Slope (2,) of the plane through points; median and 90th percentile (2,) of their distances from it, cm.

    on_ground: (N, 2) horizontal positions of the points, cm. height: (N,) their heights, cm.
    """
    points = np.column_stack([on_ground, np.ones(len(on_ground))])
    weight = np.ones(len(on_ground))
    for _ in range(FITS):
        fit = np.linalg.lstsq(points * weight[:, None], height * weight, rcond=None)[0]
        off = np.abs(height - points @ fit)
        weight = 1.0 / np.sqrt(np.maximum(off, 0.3))
    return fit[:2], np.percentile(off, [50, 90])


def _parts(skeleton: Skeleton, p: Array) -> tuple[Array, Array, Array]:
    """Three unit vectors (F, 3): up along the trunk, up along the legs, and from right to left."""
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
    """Least lean of trunk, legs and the line across the body, degrees; 0 if they lean to different sides."""
    trunk, legs, across = _parts(skeleton, p)
    left = unit(across * [1.0, 0.0, 1.0])
    leans = [float(np.mean(np.sum(part * left, axis=-1))) for part in (trunk, legs)]
    leans.append(-float(np.mean(across[:, 1])))
    one_side = min(leans) > 0 or max(leans) < 0
    return float(np.degrees(np.arcsin(min(abs(lean) for lean in leans)))) if one_side else 0.0
