"""Compares the speed of the hips with that of the feet.

Relative to the hips, a standing foot moves backward as fast as the hips move forward. If the root's positions
are in another unit than the bones, the two speeds differ.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.motion.rig import leg_length

# Allowed range of the quotient: speed of the hips / speed of the lower foot relative to the hips. It is .88
# to 1.17 in 172 clips of CMU, Holden et al. (2017) and Ferre et al., and of the data sets `styles` and
# `patients` (config/datasets).
LEAST_QUOTIENT, MOST_QUOTIENT = 0.5, 1.7
# Percentiles of the lower foot's speed relative to the hips, between which a standing foot's speed lies.
PERCENTILES = (50.0, 75.0)
IN_PLACE = 0.15  # with a smaller quotient the figure walks in place
SLOW = 0.5  # leg lengths a second; slower movements of hips and feet are not compared
# A foot stands if its speed is below STANDS times the speed of the hips. SPAN: seconds over which both speeds
# are taken.
STANDS, SPAN = 0.12, 2 / 15
# Shares of the frames with moving hips in which some foot stands: below SELDOM the clip gets a warning, below
# NEVER it is refused. The share is .29 or more in those 172 clips, and .2 if 1 cm of noise is added.
# With rotation channels declared in a wrong order it is .12 or less in 40 of 42 tries, but .25 in a walk
# straight along an axis.
SELDOM, NEVER = 0.27, 0.12
# Allowed range of the factor: if the path of the hips is scaled by it, feet stand most often. It is .85 to
# 1 in those clips; it is below 1 because feet roll.
SHORTEST, LONGEST = 0.79, 1.12
FACTORS = np.exp(np.linspace(np.log(0.4), np.log(2.5), 47))  # the factors that are tried
FEWEST = 40  # with fewer frames in which the hips move, the share is not computed
UPRIGHT = 0.6  # leg lengths: least height of an upright figure's hips above its lower foot


def pace(clip: Clip) -> float | None:
    """Speed of the hips divided by the speed of the lower foot relative to the hips.

    The foot's speed varies over the clip: any value between its PERCENTILES may be that of a standing foot.
    The value that brings the quotient nearest to 1 is taken. None if hips and foot are slow, or if the figure
    is not upright.
    """
    role, p = clip.skeleton.role, clip.positions
    if len(p) < 3:
        return None
    hips = p[:, role("hips")]
    balls = np.stack([p[:, role(f"{side}_toe")] for side in ("left", "right")], axis=1)
    from_hips = np.diff(balls - hips[:, None], axis=0)[..., [0, 2]]
    lower = balls[:-1, :, 1].argmin(axis=1)
    foot = from_hips[np.arange(len(from_hips)), lower]
    speed = float(np.median(np.linalg.norm(np.diff(hips, axis=0)[:, [0, 2]], axis=-1)))
    slow, fast = np.percentile(np.linalg.norm(foot, axis=-1), PERCENTILES)
    leg = leg_length(clip.skeleton)
    height = float(np.median(hips[:, 1] - balls[..., 1].min(axis=1)))
    if max(speed, slow) * clip.fps < SLOW * leg or height < UPRIGHT * leg:
        return None
    return speed / max(float(np.clip(speed, slow, fast)), 1e-3 * speed)


def standing_share(clip: Clip) -> tuple[float, float] | None:
    """(share of the frames in which some foot stands, factor by which the hips' path is scaled).

    The factor is the one of FACTORS that makes the share largest. Only frames in which the hips move count.
    None if there are fewer than FEWEST of them.
    """
    role, p = clip.skeleton.role, clip.positions[..., [0, 2]]
    n = max(1, round(SPAN * clip.fps))
    if len(p) <= n:
        return None
    hips = p[:, role("hips")]
    balls = np.stack([p[:, role(f"{side}_toe")] for side in ("left", "right")]) - hips
    path, feet = hips[n:] - hips[:-n], balls[:, n:] - balls[:, :-n]
    far = np.linalg.norm(path, axis=-1)
    moves = far * clip.fps / n > SLOW * leg_length(clip.skeleton)
    if moves.sum() < FEWEST:
        return None
    path, feet, far = path[moves], feet[:, moves], far[moves]
    shares = []
    for factor in FACTORS:
        slide = np.linalg.norm(factor * path + feet, axis=-1).min(axis=0)
        shares.append(float(np.mean(slide < STANDS * factor * far)))
    best = int(np.argmax(shares))
    return shares[best], float(FACTORS[best])


def check_pace(path: Path, clip: Clip, leave: bool) -> str | None:
    """A warning if the figure walks in place or its feet seldom stand; else None.

    leave: accept any pace. Raises InputError if the speeds of feet and hips contradict each other, or if the
    feet stand almost never.
    """
    if leave:
        return None
    quotient = pace(clip)
    if quotient is None or LEAST_QUOTIENT <= quotient <= MOST_QUOTIENT:
        return _check_standing(path, clip)
    if quotient < IN_PLACE:
        return (
            "The legs walk and the hips stay in place, so the feet slide. The file has no path of the hips."
        )
    raise _two_units(path, quotient)


def _check_standing(path: Path, clip: Clip) -> str | None:
    standing = standing_share(clip)
    if standing is None:
        return None
    share, factor = standing
    if share < NEVER:
        raise InputError(
            path,
            "no foot stands while the hips go: the motion is very noisy, or its rotation channels are "
            "declared in another order than they were written",
            fix="Export the clip again. If the feet really slide (a skater, a vehicle), set motion.defects: "
            "leave.",
        )
    if share < SELDOM:
        return (
            f"A foot stands in {share:.0%} of the frames in which the hips go, which is less than in any "
            "walk or run. The motion is noisy, or its rotation channels are declared in another order than "
            "they were written."
        )
    if not SHORTEST <= factor <= LONGEST:
        raise _two_units(path, 1 / factor)
    return None


def _two_units(path: Path, quotient: float) -> InputError:
    times = f"{quotient:.{2 if quotient < 10 else 0}f}"
    return InputError(
        path,
        f"the hips go {times} times as fast as the feet step, so the root's positions seem to be in another "
        "unit than the OFFSETs",
        fix="Export the clip again with one unit. If the feet really slide (a skater, a vehicle), set "
        "motion.defects: leave.",
    )
