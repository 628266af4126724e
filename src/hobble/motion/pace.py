"""Compares the speed of the hips with that of the feet.

Relative to the hips, a standing foot moves backward as fast as the hips move forward. The two speeds differ
if the file gives the root's positions in another unit than the bones.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.motion.rig import leg_length

# Allowed range of the quotient: speed of the hips / speed of the lower foot relative to the hips. It is .88
# to 1.17 in 172 reference clips: those of CMU, Holden et al. (2017) and Ferre et al., and of the data sets
# `styles` and `patients` (config/datasets).
LEAST_QUOTIENT, MOST_QUOTIENT = 0.5, 1.7
# The speed of a standing foot relative to the hips is assumed to lie between these percentiles of the lower
# foot's speed.
PERCENTILES = (50.0, 75.0)
IN_PLACE = 0.15  # if the quotient is smaller, the figure walks in place
SLOW = 0.5  # leg lengths a second; slower movements of hips and feet are not compared
# A foot stands if its speed is below STANDS times the speed of the hips. SPAN: seconds over which the two
# speeds are averaged.
STANDS, SPAN = 0.12, 2 / 15
# Limits of the standing share. This is the share of frames in which some foot stands, among the frames in
# which the hips move. Below SELDOM the clip gets a warning, below NEVER it is refused. The share is .29 or
# more in the 172 reference clips, and .2 after 1 cm of noise is added. With rotation channels declared in a
# wrong order it is .12 or less in 40 of 42 tries, but .25 in a walk straight along an axis.
SELDOM, NEVER = 0.27, 0.12
# Allowed range of the factor by which the hips' path must be scaled so that feet stand most often. The factor
# is .85 to 1 in the reference clips. It is below 1 because feet roll.
SHORTEST, LONGEST = 0.79, 1.12
FACTORS = np.exp(np.linspace(np.log(0.4), np.log(2.5), 47))  # the factors that are tried
FEWEST = 40  # frames in which the hips move; with fewer, the standing share is not computed
UPRIGHT = 0.6  # leg lengths: least height of an upright figure's hips above its lower foot


def speed_quotient(clip: Clip) -> float | None:
    """Speed of the hips divided by the speed of the lower foot relative to the hips.

    The lower foot's speed varies over the clip, and any value between its PERCENTILES may be that of a
    standing foot. The value that brings the quotient nearest to 1 is taken. None if the clip has fewer than
    three frames, if hips and foot are slow, or if the figure is not upright.
    """
    role, positions = clip.skeleton.role, clip.positions
    if len(positions) < 3:
        return None
    hips = positions[:, role("hips")]
    balls = np.stack([positions[:, role(f"{side}_toe")] for side in ("left", "right")], axis=1)
    from_hips = np.diff(balls - hips[:, None], axis=0)[..., [0, 2]]
    lower = balls[:-1, :, 1].argmin(axis=1)
    foot = from_hips[np.arange(len(from_hips)), lower]
    hips_speed = float(np.median(np.linalg.norm(np.diff(hips, axis=0)[:, [0, 2]], axis=-1)))
    slow, fast = np.percentile(np.linalg.norm(foot, axis=-1), PERCENTILES)
    leg = leg_length(clip.skeleton)
    height = float(np.median(hips[:, 1] - balls[..., 1].min(axis=1)))
    if max(hips_speed, slow) * clip.fps < SLOW * leg or height < UPRIGHT * leg:
        return None
    return hips_speed / max(float(np.clip(hips_speed, slow, fast)), 1e-3 * hips_speed)


def standing_share(clip: Clip) -> tuple[float, float] | None:
    """The share of frames in which some foot stands, and the factor by which the hips' path is scaled for it.

    The factor is the one of FACTORS that makes the share largest. Only frames in which the hips move count.
    None if there are fewer than FEWEST such frames.
    """
    role, places = clip.skeleton.role, clip.positions[..., [0, 2]]
    span = max(1, round(SPAN * clip.fps))  # frames
    if len(places) <= span:
        return None
    hips = places[:, role("hips")]
    balls = np.stack([places[:, role(f"{side}_toe")] for side in ("left", "right")]) - hips
    # How far the hips move within a span, and how far each foot moves relative to the hips.
    hips_moved, feet_moved = hips[span:] - hips[:-span], balls[:, span:] - balls[:, :-span]
    distance = np.linalg.norm(hips_moved, axis=-1)
    moves = distance * clip.fps / span > SLOW * leg_length(clip.skeleton)
    if moves.sum() < FEWEST:
        return None
    hips_moved, feet_moved, distance = hips_moved[moves], feet_moved[:, moves], distance[moves]
    shares = []
    for factor in FACTORS:
        slide = np.linalg.norm(factor * hips_moved + feet_moved, axis=-1).min(axis=0)
        shares.append(float(np.mean(slide < STANDS * factor * distance)))
    best = int(np.argmax(shares))
    return shares[best], float(FACTORS[best])


def check_pace(path: Path, clip: Clip, leave: bool) -> str | None:
    """A warning if the figure walks in place or its feet seldom stand; else None.

    path: of the BVH file, for messages. leave: check nothing and return None. Raises InputError if the speeds
    of feet and hips contradict each other, or if no foot stands in more than a few frames.
    """
    if leave:
        return None
    quotient = speed_quotient(clip)
    if quotient is None or LEAST_QUOTIENT <= quotient <= MOST_QUOTIENT:
        return _check_standing_share(path, clip)
    if quotient < IN_PLACE:
        return "The legs walk, but the hips stay in place, so the feet slide. The file hardly moves the hips."
    raise _units_error(path, quotient)


def _check_standing_share(path: Path, clip: Clip) -> str | None:
    """The part of `check_pace` that uses `standing_share`."""
    standing = standing_share(clip)
    if standing is None:
        return None
    share, factor = standing
    if share < NEVER:
        raise InputError(
            path,
            f"the feet slide: while the hips move, a foot stands in only {share:.0%} of the frames. The "
            "motion is very noisy, or its rotation channels are declared in another order than they were "
            "written",
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
        raise _units_error(path, 1 / factor)
    return None


def _units_error(path: Path, quotient: float) -> InputError:
    """The error for a root and bones in different units. quotient: speed of the hips / speed of the feet."""
    times = f"{quotient:.{2 if quotient < 10 else 0}f}"
    return InputError(
        path,
        f"the hips go {times} times as fast as the feet step, so the root's positions seem to be in another "
        "unit than the OFFSETs",
        fix="Export the clip again with one unit. If the feet really slide (a skater, a vehicle), set "
        "motion.defects: leave.",
    )
