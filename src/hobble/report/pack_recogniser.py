"""Packs the recogniser of limps for the page.

The page gets statistics of people's limps, and a profile of the character's healthy walk, with which the
recogniser compares the character's present walk.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.skeleton import Skeleton
from hobble.gait.cycles import measure
from hobble.gait.features import features
from hobble.gait.limp_grade import LEANING, PARTS, STRENGTHS, Grader, grader
from hobble.gait.people import people
from hobble.gait.profile import Profile, profile
from hobble.gait.recogniser import SIDES
from hobble.models.network import Network
from hobble.models.packing import packed
from hobble.report.playable import playable
from hobble.report.straight_walk import walk_straight
from hobble.runtime.export import jointed
from hobble.runtime.options import Runtime

FPS = 60
WARM_UP, MEASURED = 3 * FPS, 8 * FPS  # frames to get up to speed, and frames that are measured
ROLES = ("hip", "knee", "heel", "toe", "shoulder")  # joint roles that the skeleton must have on both sides


def playable_with_recogniser(network: Network, runtime: Runtime) -> dict[str, Any]:
    """The data of `hobble.report.playable`, and under `recogniser` what the page needs to recognise a limp.

    There is no `recogniser` if the network has no channel for parts of the body, if its skeleton lacks one of
    ROLES, or if the healthy character walks no complete gait cycle.
    """
    spec = playable(network, runtime)
    if any(channel["regions"] for channel in spec.get("channels", ())):
        assert network.skeleton is not None
        healthy = healthy_walk(network, network.skeleton, runtime)
        if healthy is not None:
            spec["recogniser"] = {"learnt": learnt(), "healthy": healthy}
    return spec


def healthy_walk(network: Network, skeleton: Skeleton, runtime: Runtime) -> Profile | None:
    """The profile of the healthy character walking straight on, with joints placed as in the page.

    None if its skeleton lacks one of ROLES, or if it walks no complete gait cycle.
    """
    if not all(f"{side}_{part}" in skeleton.roles for side in SIDES for part in ROLES):
        return None
    poses = [pose for _, pose in walk_straight(network, runtime, WARM_UP + MEASURED, {})][WARM_UP:]
    positions, rotations = np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
    walk = measure(skeleton, jointed(skeleton, positions, rotations)[1], FPS)
    return profile(walk) if len(walk) else None


def learnt(statistics: Grader | None = None) -> dict[str, Any]:
    """Packs what `hobble.gait.limp_grade` learnt from people's walks with D features each.

    In the result, `features`: names of the features. `strengths`: the strengths of a limp that are tried.
    `healthySpread`: (D, D) covariance of healthy walks. `kinds`: for each kind of limp (a label and a side),
    its `words` for the page, the `mean` (D,) at strength 1, and the covariance `spread` (D, D). Arrays are
    float64 in base64.
    """
    statistics = statistics or grader()
    normal = people().normal()
    return {
        "features": list(features(normal, normal)),
        "strengths": STRENGTHS.tolist(),
        "healthySpread": packed(statistics.healthy),
        "kinds": [
            {
                "label": label,
                "side": side,
                "words": words(label, side),
                "mean": packed(mean),
                "spread": packed(spread),
            }
            for (label, side), (mean, spread) in statistics.kinds.items()
        ],
    }


def words(label: str, side: str) -> str:
    """A kind of limp in words, such as "left thigh, shank or foot" or "back, leaning forward"."""
    parts = PARTS[label]
    named = parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} or {parts[-1]}"
    return f"{named}, leaning {side}" if label == LEANING else f"{side} {named}"
