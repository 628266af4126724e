"""Finds clips whose whole world is tilted, so that their Y axis is not vertical.

In a tilted world, the ground under the feet is tilted, and the body balances along a line that is tilted
equally. On a real slope only the ground is tilted, and the body still balances along Y.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.motion.orient import unit_vectors
from hobble.motion.physics import Balance, find_balance
from hobble.motion.rig import leg_length

# A plane, called the ground, is fitted to the balls of standing feet. Its axes are the horizontal direction
# along which the feet spread most and the one across it.
# Degrees: smaller tilts are ignored. LEAST_TILT is for axes along which the feet spread widely. Along these,
# flat ground seems tilted by at most 1.2 degrees in 172 clips of CMU, Holden et al. (2017) and Ferre et al.,
# and of the data sets `styles` and `patients` (config/datasets). LEAST_TILT_NARROW is for axes along which
# the feet spread less, and for clips that show the ground or the balance of the body less well.
LEAST_TILT, LEAST_TILT_NARROW = 4.0, 6.0
# Body and ground show the same tilt if they differ by less than this share of the ground's tilt.
MOST_APART = 0.6
MOST_OFF = 2.5  # cm; if the median distance of standing feet from the ground is larger, its slope is not used
# cm; if the 90th percentile of these distances is larger, tilts below LEAST_TILT_NARROW are ignored.
UNEVEN = 4.0
# Degrees by which the direction in which a body balances may lean to one side of Y. The limit is BALANCED if
# each foot stands alone for at least LONG seconds. For shorter times it is higher, up to BALANCED_SHORT at 0
# seconds. In the 172 clips the direction leans by at most 3.9 degrees if the time is at least LONG, and by at
# most 6 degrees if it is shorter.
BALANCED, BALANCED_SHORT, LONG = 5.0, 9.0, 0.2
# Degrees. If a foot stands alone too briefly to judge the balance, the world counts as tilted if trunk, legs
# and the line across the body all lean to the same side by more than this. In the 172 clips the least of the
# three leans is at most 7.5, in a walk with a hurt leg.
MOST_SIDEWAYS = 8.0
FORWARD_LEAN = 4.0  # degrees by which a walking body usually leans forward
# The spread of feet along an axis is the standard deviation of their positions, in leg lengths. First the
# slope is measured only along axes with a spread above WIDE, then along all axes with a spread above NARROW.
# With less spread, feet show no slope.
WIDE = 0.4
NARROW = 0.05
SLOW = 0.3  # leg lengths a second; the ball of a standing foot is slower
FEWEST = 10  # if there are fewer positions of standing feet, no ground is fitted
# Number of least-squares fits. Each gives more weight to feet that were near the fit before, so that the last
# one nearly minimises the sum of distances from the ground, and a few wrong feet have little effect.
FITS = 12


def world_tilt(clip: Clip) -> float | None:
    """Degrees by which the world is tilted, or None if nothing shows a tilt."""
    leg = leg_length(clip.skeleton)
    body, is_level = find_balance(clip), False
    up = _up_from_posture(clip.skeleton, clip.positions) if body is None else body.up
    feet = standing_ball_positions(clip)
    if len(feet) >= FEWEST:
        horizontal = feet[:, [0, 2]] - feet[:, [0, 2]].mean(axis=0)
        variances, axes = np.linalg.eigh(np.cov(horizontal.T))
        slope, distances = _fitted_plane(horizontal @ axes, feet[:, 1])
        # (2,) parts, along the two axes, of the ground's normal and of the direction up the body.
        normal, lean = -slope / np.sqrt(1 + slope @ slope), up @ axes
        spread = np.sqrt(np.maximum(variances, 0.0))
        even = distances[0] < MOST_OFF
        least = LEAST_TILT if body is not None and distances[1] < UNEVEN else LEAST_TILT_NARROW
        for used, smallest in ((spread > WIDE * leg, least), (spread > NARROW * leg, LEAST_TILT_NARROW)):
            sine = float(np.linalg.norm(normal[used]))
            apart = float(np.linalg.norm((lean - normal)[used]))
            if even and sine > np.sin(np.radians(smallest)) and apart < MOST_APART * sine:
                return float(np.degrees(np.arcsin(min(sine, 1.0))))
        is_level = bool(
            (spread > WIDE * leg).all() and np.linalg.norm(normal) < np.sin(np.radians(LEAST_TILT))
        )
    return None if is_level else _sideways_tilt(clip, body)


def _sideways_tilt(clip: Clip, body: Balance | None) -> float | None:
    """Degrees by which a body balances or leans to one side; None if this is too little to show a tilt."""
    if body is not None:
        most = np.interp(body.seconds, [0.0, LONG], [BALANCED_SHORT, BALANCED])
        if abs(body.aside) > most:
            return abs(body.aside)
        if body.seconds >= LONG:
            return None
    least_lean = _least_sideways_lean(clip.skeleton, clip.positions)
    return least_lean if least_lean > MOST_SIDEWAYS else None


def check_tilt(path: Path, clip: Clip, leave: bool) -> None:
    """Raise InputError if the world is tilted. leave: whether any tilt is accepted."""
    tilt = None if leave else world_tilt(clip)
    if tilt is not None:
        raise InputError(
            path,
            f"the ground or the body is tilted by {tilt:.0f} degrees, so the whole world seems tilted",
            fix="Make the floor level in the program that the clip comes from, and export the clip again. If "
            "the figure walked on a slope or really leans that far, set motion.defects: leave.",
        )


def standing_ball_positions(clip: Clip) -> Array:
    """Positions (N, 3) of the balls of both feet, each in the frames in which this foot stands, cm."""
    p, role, leg = clip.positions, clip.skeleton.role, leg_length(clip.skeleton)
    balls = np.stack([p[:, role(f"{side}_toe")] for side in ("left", "right")], axis=1)
    reach = max(1, round(clip.fps / 20))  # speeds are measured from this many frames before to as many after
    speed = np.linalg.norm(balls[2 * reach :] - balls[: -2 * reach], axis=-1) * clip.fps / (2 * reach)
    return np.asarray(balls[reach : len(balls) - reach][speed < SLOW * leg])


def _fitted_plane(horizontal: Array, height: Array) -> tuple[Array, Array]:
    """Fit a plane to points. horizontal: (N, 2) their horizontal positions, cm. height: (N,) in cm.

    Returns the slopes (2,) along both horizontal axes, and the median and the 90th percentile (2,) of the
    vertical distances of the points from the plane, cm.
    """
    points = np.column_stack([horizontal, np.ones(len(horizontal))])
    weight = np.ones(len(horizontal))
    for _ in range(FITS):
        fit = np.linalg.lstsq(points * weight[:, None], height * weight, rcond=None)[0]
        distances = np.abs(height - points @ fit)
        weight = 1.0 / np.sqrt(np.maximum(distances, 0.3))  # at least 0.3 cm, so that no weight is infinite
    return fit[:2], np.percentile(distances, [50, 90])


def _body_directions(skeleton: Skeleton, p: Array) -> tuple[Array, Array, Array]:
    """Three unit vectors (F, 3): up along the trunk, up along the legs, and from right to left.

    p: (F, J, 3) positions of the joints.
    """
    at = {role: p[:, skeleton.role(role)] for role in skeleton.roles}
    across = at["left_hip"] - at["right_hip"] + at["left_shoulder"] - at["right_shoulder"]
    legs = at["hips"] - 0.5 * (at["left_heel"] + at["right_heel"])
    return unit_vectors(at["head"] - at["hips"]), unit_vectors(legs), unit_vectors(across)


def _up_from_posture(skeleton: Skeleton, p: Array) -> Array:
    """(2,) x and z of the mean unit vector up the body, without the usual forward lean of a walk.

    p: (F, J, 3) positions of the joints.
    """
    trunk, legs, across = _body_directions(skeleton, p)
    ahead = unit_vectors(np.cross(across, [0.0, 1.0, 0.0]))
    return np.asarray(
        (unit_vectors(trunk + legs) - np.sin(np.radians(FORWARD_LEAN)) * ahead)[:, [0, 2]].mean(axis=0)
    )


def _least_sideways_lean(skeleton: Skeleton, p: Array) -> float:
    """The least of three sideways leans: of the trunk, of the legs and of the line across the body, degrees.

    0 if they do not all lean to the same side. p: (F, J, 3) positions of the joints.
    """
    trunk, legs, across = _body_directions(skeleton, p)
    left = unit_vectors(across * [1.0, 0.0, 1.0])
    # Sines of the leans, positive to the left.
    leans = [float(np.mean(np.sum(part * left, axis=-1))) for part in (trunk, legs)]
    leans.append(-float(np.mean(across[:, 1])))
    one_side = min(leans) > 0 or max(leans) < 0
    return float(np.degrees(np.arcsin(min(abs(lean) for lean in leans)))) if one_side else 0.0
