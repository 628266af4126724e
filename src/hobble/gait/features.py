"""Features of a walk relative to the same person's healthy walk: about twenty numbers that distinguish
impairments.

Speed and stride time are not used, and most features compare the two sides, because a healthy walk changes
with its speed but stays symmetric.
"""

from __future__ import annotations

import numpy as np

from hobble.gait.profile import Profile

LEAST_RANGE = 3.0  # degrees: smaller ranges are raised to this, because ratios of tiny ranges are arbitrary
MOST_RATIO = 5.0  # larger ratios are limited to this
# Names of features.
TRUNK_FORWARD, TRUNK_LEFT = "mean trunk_forward", "mean trunk_left"
TRUNK = (TRUNK_FORWARD, TRUNK_LEFT, "range trunk_forward", "range trunk_left")
ARMS = "range arm_forward R - L"


def features(walk: Profile, healthy: Profile) -> dict[str, float]:
    """The features of a walk relative to the same person's healthy walk.

    Most are differences from the healthy walk in degrees, leg lengths or shares of the cycle. The flexion
    ranges of knees and hips and the swing of the arms are first divided by their healthy values. The ratios
    of knees and hips are compared as right minus left, the ratios of the arms as the logarithm of right over
    left.
    """

    def change(name: str) -> float:
        return walk[name] - healthy[name]

    def share(name: str) -> float:
        now, usual = walk[f"range {name}"], healthy[f"range {name}"]
        return min(max(now, LEAST_RANGE) / max(usual, LEAST_RANGE), MOST_RATIO)

    def sides(name: str) -> float:
        return change(f"{name}_R") - change(f"{name}_L")

    out = {
        "stance L - R": -sides("stance_share"),
        "left landing": change("left_strike_phase"),
        "step R - L": sides("step"),
        "step width": change("step_width"),
        "range hip_abduction R - L": sides("range hip_abduction"),
        "range ankle_height R - L": sides("range ankle_height"),
    }
    for part in ("knee_flexion", "hip_flexion"):
        out[f"range {part} R - L"] = share(f"{part}_R") - share(f"{part}_L")
    arms = np.log(share("arm_forward_R") / share("arm_forward_L"))
    out[ARMS] = float(np.clip(arms, -np.log(MOST_RATIO), np.log(MOST_RATIO)))
    for part in ("knee_flexion", "hip_flexion", "hip_abduction"):
        out |= {f"mean {part} {side}": change(f"mean {part}_{side}") for side in "RL"}
    for part in ("trunk_forward", "trunk_left", "pelvis_left_up"):
        out |= {f"{statistic} {part}": change(f"{statistic} {part}") for statistic in ("range", "mean")}
    return out
