"""Compares how fast the hips go with how fast the feet step.

A foot that stands moves backward, seen from the hips, as fast as they go forward. If the root's positions are
in another unit than the bones, the two speeds differ.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.motion.rig import leg_length

# Speed of the hips / speed of the lower foot seen from the hips. In 172 clips of CMU, styles, patients,
# Ferre et al. and the original release it is .88 to 1.17.
LEAST, MOST = 0.5, 1.7
STEPS = (50.0, 75.0)  # percentiles of the foot's speed, which is lower in the air than on the ground
IN_PLACE = 0.15
SLOW = 0.5  # leg lengths a second: slower movements are not compared
UPRIGHT = 0.6  # least height of the hips above the lower foot, in leg lengths


def pace(clip: Clip) -> float | None:
    """Speed of the hips divided by that of the lower foot seen from the hips, by the quantile nearest to 1.

    None if both are slow, or if the figure is not upright.
    """
    role, p = clip.skeleton.role, clip.positions
    if len(p) < 3:
        return None
    hips = p[:, role("hips")]
    balls = np.stack([p[:, role(f"{side}_toe")] for side in ("left", "right")], axis=1)
    seen = np.diff(balls - hips[:, None], axis=0)[..., [0, 2]]
    lower = balls[:-1, :, 1].argmin(axis=1)
    foot = seen[np.arange(len(seen)), lower]
    speed = float(np.median(np.linalg.norm(np.diff(hips, axis=0)[:, [0, 2]], axis=-1)))
    slow, fast = np.percentile(np.linalg.norm(foot, axis=-1), STEPS)
    leg = leg_length(clip.skeleton)
    height = float(np.median(hips[:, 1] - balls[..., 1].min(axis=1)))
    if max(speed, slow) * clip.fps < SLOW * leg or height < UPRIGHT * leg:
        return None
    return speed / max(float(np.clip(speed, slow, fast)), 1e-3 * speed)


def check_pace(path: Path, clip: Clip, leave: bool) -> str | None:
    """A sentence if the clip walks in place, else None.

    leave: accept any pace. Raises InputError if the feet do not step as fast as the hips go.
    """
    found = pace(clip)
    if found is None or LEAST <= found <= MOST or leave:
        return None
    if found < IN_PLACE:
        return (
            "The legs walk and the hips stay in place, so the feet slide. The file has no path of the hips."
        )
    times = f"{found:.{2 if found < 10 else 0}f}"
    raise InputError(
        path,
        f"the hips go {times} times as fast as the feet step, so the root's positions seem to be in another "
        "unit than the OFFSETs",
        fix="Export the clip again with one unit. If the feet really slide (a skater, a vehicle), set "
        "motion.defects: leave.",
    )
