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

# Allowed quotients: speed of the hips / speed of the lower foot relative to the hips. In 172 clips of CMU,
# styles, patients, Ferre et al. and the original release it is .88 to 1.17.
LEAST, MOST = 0.5, 1.7
# Percentiles of the foot's speed relative to the hips. The higher ones are of the standing foot.
PERCENTILES = (50.0, 75.0)
IN_PLACE = 0.15  # with a smaller quotient the figure walks in place
SLOW = 0.5  # leg lengths a second: slower movements are not compared
# A foot stands if it is slower than this share of the speed of the hips, both over this many seconds.
STANDS, SPAN = 0.12, 2 / 15
# The share of frames in which some foot stands while the hips move. Below SELDOM the clip gets a warning,
# below NEVER it is refused. The share is .29 or more in those 172 clips, and .2 with 1 cm of noise. With
# rotation channels declared in a wrong order it is .12 or less in 40 of 42 tries, but .25 in a walk straight
# along an axis.
SELDOM, NEVER = 0.27, 0.12
# Allowed factors by which to scale the path of the hips so that feet stand most often. In those clips the
# factor is .85 to 1, because feet roll.
SHORTEST, LONGEST = 0.79, 1.12
FACTORS = np.exp(np.linspace(np.log(0.4), np.log(2.5), 47))
FEWEST = 40  # fewest frames in which the hips move
UPRIGHT = 0.6  # least height of the hips above the lower foot, in leg lengths


def pace(clip: Clip) -> float | None:
    """Speed of the hips divided by the speed of the lower foot relative to the hips.

    Any speed of the foot between its PERCENTILES is allowed. The one that brings the quotient nearest
    to 1 is taken. None if both are slow, or if the figure is not upright.
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
    """Share of the frames in which some foot stands, and the factor of the hips' path that makes it largest.

    None if the hips hardly move.
    """
    role, p = clip.skeleton.role, clip.positions[..., [0, 2]]
    n = max(1, round(SPAN * clip.fps))
    if len(p) <= n:
        return None
    hips = p[:, role("hips")]
    balls = np.stack([p[:, role(f"{side}_toe")] for side in ("left", "right")]) - hips
    path, feet = hips[n:] - hips[:-n], balls[:, n:] - balls[:, :-n]
    far = np.linalg.norm(path, axis=-1)
    goes = far * clip.fps / n > SLOW * leg_length(clip.skeleton)
    if goes.sum() < FEWEST:
        return None
    path, feet, far = path[goes], feet[:, goes], far[goes]
    shares = []
    for factor in FACTORS:
        slide = np.linalg.norm(factor * path + feet, axis=-1).min(axis=0)
        shares.append(float(np.mean(slide < STANDS * factor * far)))
    best = int(np.argmax(shares))
    return shares[best], float(FACTORS[best])


def check_pace(path: Path, clip: Clip, leave: bool) -> str | None:
    """A warning if the figure walks in place or its feet seldom stand; else None.

    leave: accept any pace. Raises InputError if the speeds of feet and hips do not fit, or if no foot stands.
    """
    if leave:
        return None
    found = pace(clip)
    if found is None or LEAST <= found <= MOST:
        return _check_standing(path, clip)
    if found < IN_PLACE:
        return (
            "The legs walk and the hips stay in place, so the feet slide. The file has no path of the hips."
        )
    raise _two_units(path, found)


def _check_standing(path: Path, clip: Clip) -> str | None:
    found = standing_share(clip)
    if found is None:
        return None
    share, factor = found
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


def _two_units(path: Path, found: float) -> InputError:
    times = f"{found:.{2 if found < 10 else 0}f}"
    return InputError(
        path,
        f"the hips go {times} times as fast as the feet step, so the root's positions seem to be in another "
        "unit than the OFFSETs",
        fix="Export the clip again with one unit. If the feet really slide (a skater, a vehicle), set "
        "motion.defects: leave.",
    )
