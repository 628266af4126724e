"""The recogniser of limps, packed for the page.

It is what was learnt of people's walks, and the healthy walk of the character, beside which its limps stand.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.skeleton import Skeleton
from hobble.gait.cycles import measure
from hobble.gait.features import features
from hobble.gait.graded import LEANING, PARTS, STRENGTHS, Grader, grader
from hobble.gait.people import people
from hobble.gait.profile import Profile, profile
from hobble.gait.recogniser import SIDES
from hobble.models.network import Network
from hobble.models.packing import packed
from hobble.report.playable import playable
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.export import jointed
from hobble.runtime.options import Runtime

FPS = 60
SPEED = 2.5  # cm a frame, as Play walks
BEGIN, WATCHED = 3 * FPS, 8 * FPS  # frames that a character has to get up to speed, and that are measured
ROLES = ("hip", "knee", "heel", "toe", "shoulder")  # of each side, without which nothing is measured


def playable_and_judged(network: Network, runtime: Runtime) -> dict[str, Any]:
    """`playable`, and under `recogniser` what the page needs to say what a walk looks like.

    `recogniser` is missing where nothing can be said: the network is not told where it hurts, its rig lacks
    a role, or its healthy character makes no cycle of a walk.
    """
    spec = playable(network, runtime)
    if any(channel["regions"] for channel in spec.get("channels", ())):
        assert network.skeleton is not None
        healthy = healthy_walk(network, network.skeleton, runtime)
        if healthy is not None:
            spec["recogniser"] = {"learnt": learnt(), "healthy": healthy}
    return spec


def healthy_walk(network: Network, skeleton: Skeleton, runtime: Runtime) -> Profile | None:
    """The profile of the character that walks on, told nothing, its joints where the page has them."""
    if not all(f"{side}_{part}" in skeleton.roles for side in SIDES for part in ROLES):
        return None
    animation = ProceduralAnimation(network, **dict(runtime))
    ahead = np.array([0.0, SPEED])
    poses = [animation.next_pose(ahead, None, "walk") for _ in range(BEGIN + WATCHED)][BEGIN:]
    positions, rotations = np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
    walk = measure(skeleton, jointed(skeleton, positions, rotations)[1], FPS)
    return profile(walk) if len(walk) else None


def learnt(known: Grader | None = None) -> dict[str, Any]:
    """What `hobble.gait.graded` learnt, D numbers a walk.

    `features`: their names. `strengths`. `healthySpread`: (D, D) covariance of healthy walks. `kinds`: for
    each label and side the `words` that a visitor reads, `mean` (D,) at strength 1 and `spread` (D, D).
    Arrays are base64 of float64.
    """
    known = known or grader()
    normal = people().normal()
    return {
        "features": list(features(normal, normal)),
        "strengths": STRENGTHS.tolist(),
        "healthySpread": packed(known.healthy),
        "kinds": [
            {
                "label": label,
                "side": side,
                "words": words(label, side),
                "mean": packed(mean),
                "spread": packed(spread),
            }
            for (label, side), (mean, spread) in known.kinds.items()
        ],
    }


def words(label: str, side: str) -> str:
    """What a visitor reads: "left thigh, shank or foot", "back, leaning forward"."""
    parts = PARTS[label]
    named = parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} or {parts[-1]}"
    return f"{named}, leaning {side}" if label == LEANING else f"{side} {named}"
