"""A walk against the same walker's healthy one, in some twenty numbers that tell impairments apart.

Neither speed nor stride time is among them, and most compare the two sides: a healthy walk changes with its
speed but stays even.
"""

from __future__ import annotations

import numpy as np

from hobble.gait.profile import Profile

MOST_ARMS = np.log(5)  # arms differ by any factor where one keeps still; more than five says no more
TRUNK = ("range trunk_forward", "mean trunk_forward", "range trunk_left", "mean trunk_left")
ARMS = "range arm_forward R - L"


def features(walk: Profile, healthy: Profile) -> dict[str, float]:
    """What tells the impairments apart: a walk against the same walker's healthy one.

    Degrees, leg lengths, shares of the cycle; of ranges shares of the healthy range, of arms their logarithm.
    """

    def change(name: str) -> float:
        return walk[name] - healthy[name]

    def share(name: str) -> float:
        return walk[f"range {name}"] / max(healthy[f"range {name}"], 1e-6)

    out = {
        "stance L - R": change("stance_share_L") - change("stance_share_R"),
        "left landing": change("left_strike_phase"),
        "step R - L": change("step_R") - change("step_L"),
        "step width": change("step_width"),
    }
    for part in ("knee_flexion", "hip_flexion", "hip_abduction", "ankle_height"):
        out[f"range {part} R - L"] = share(f"{part}_R") - share(f"{part}_L")
    arms = np.log(max(share("arm_forward_R"), 1e-6) / max(share("arm_forward_L"), 1e-6))
    out["range arm_forward R - L"] = float(np.clip(arms, -MOST_ARMS, MOST_ARMS))
    for part in ("knee_flexion", "hip_flexion", "hip_abduction"):
        out |= {f"mean {part} {side}": change(f"mean {part}_{side}") for side in "RL"}
    for part in ("trunk_forward", "trunk_left", "pelvis_left_up"):
        out |= {f"{kind} {part}": change(f"{kind} {part}") for kind in ("range", "mean")}
    return out
