"""Compares a walk with the same person's healthy walk by 21 features, which distinguish impairments.

Speed and stride time are not used, and many features compare the two sides, because a healthy walk changes
with its speed but stays symmetric.
"""

from __future__ import annotations

import numpy as np

from hobble.gait.profile import Profile

LEAST_RANGE = 3.0  # degrees: smaller ranges are raised to this, because ratios of tiny ranges are arbitrary
MOST_RATIO = 5.0  # larger ratios are lowered to this
# Names of the features of trunk and arms.
TRUNK_FORWARD, TRUNK_LEFT = "mean trunk_forward", "mean trunk_left"
TRUNK = (TRUNK_FORWARD, TRUNK_LEFT, "range trunk_forward", "range trunk_left")
ARMS = "range arm_forward R - L"


def features(walk: Profile, healthy: Profile) -> dict[str, float]:
    """Name of each feature -> its value, relative to the same person's healthy walk.

    Most features are differences from the healthy walk, in degrees, leg lengths or shares of the cycle. The
    flexion ranges of knees and hips and the swing of the arms are first divided by their healthy values. For
    knees and hips, the feature is the right ratio minus the left one. For the arms, it is the logarithm of
    the right ratio over the left one.
    """

    def change(name: str) -> float:
        return walk[name] - healthy[name]

    def range_ratio(name: str) -> float:
        now, usual = walk[f"range {name}"], healthy[f"range {name}"]
        return min(max(now, LEAST_RANGE) / max(usual, LEAST_RANGE), MOST_RATIO)

    def right_minus_left(name: str) -> float:
        return change(f"{name}_R") - change(f"{name}_L")

    out = {
        "stance L - R": -right_minus_left("stance_share"),
        "left landing": change("left_strike_phase"),
        "step R - L": right_minus_left("step"),
        "step width": change("step_width"),
        "range hip_abduction R - L": right_minus_left("range hip_abduction"),
        "range ankle_height R - L": right_minus_left("range ankle_height"),
    }
    for part in ("knee_flexion", "hip_flexion"):
        out[f"range {part} R - L"] = range_ratio(f"{part}_R") - range_ratio(f"{part}_L")
    arms = np.log(range_ratio("arm_forward_R") / range_ratio("arm_forward_L"))
    out[ARMS] = float(np.clip(arms, -np.log(MOST_RATIO), np.log(MOST_RATIO)))
    for part in ("knee_flexion", "hip_flexion", "hip_abduction"):
        out |= {f"mean {part} {side}": change(f"mean {part}_{side}") for side in "RL"}
    for part in ("trunk_forward", "trunk_left", "pelvis_left_up"):
        out |= {f"{statistic} {part}": change(f"{statistic} {part}") for statistic in ("range", "mean")}
    return out
