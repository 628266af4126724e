"""Packs the data with which the report page recognises limps of the character.

The page compares the character's present walk with the profile of its healthy walk, and the difference with
statistics of people's limps. A profile describes a walk by some fifty numbers.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hobble.core.skeleton import Skeleton
from hobble.gait.cycles import measure_cycles
from hobble.gait.features import features
from hobble.gait.limp_grade import LEANING, PARTS, STRENGTHS, Grader, grader_of_all_people
from hobble.gait.people import read_people
from hobble.gait.profile import Profile, profile_of_walk
from hobble.gait.recogniser import SIDES
from hobble.models.network import Network
from hobble.models.packing import to_base64
from hobble.report.playable import playable_data
from hobble.report.straight_walk import walk_straight
from hobble.runtime.export import restore_bone_lengths
from hobble.runtime.options import Runtime

FPS = 60
WARM_UP, MEASURED = 3 * FPS, 8 * FPS  # frames to get up to speed, and frames that are measured
ROLES = ("hip", "knee", "heel", "toe", "shoulder")  # joint roles that the skeleton must have on both sides


def playable_with_recogniser(network: Network, runtime: Runtime) -> dict[str, Any]:
    """The data of `hobble.report.playable`, and under `recogniser` what the page needs to recognise a limp.

    There is no `recogniser` if no channel (group of inputs) of the network belongs to parts of the body, if
    the skeleton lacks one of ROLES, or if the healthy character walks no complete gait cycle.
    """
    spec = playable_data(network, runtime)
    if any(channel["regions"] for channel in spec.get("channels", ())):
        assert network.skeleton is not None
        healthy = healthy_walk(network, network.skeleton, runtime)
        if healthy is not None:
            spec["recogniser"] = {"learnt": packed_statistics(), "healthy": healthy}
    return spec


def healthy_walk(network: Network, skeleton: Skeleton, runtime: Runtime) -> Profile | None:
    """The profile of the healthy character walking straight on. Bones have constant lengths, as in the page.

    None if the skeleton lacks one of ROLES, or if the character walks no complete gait cycle.
    """
    if not all(f"{side}_{part}" in skeleton.roles for side in SIDES for part in ROLES):
        return None
    poses = [pose for _, pose in walk_straight(network, runtime, WARM_UP + MEASURED, {})][WARM_UP:]
    positions, rotations = np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
    walk = measure_cycles(skeleton, restore_bone_lengths(skeleton, positions, rotations)[1], FPS)
    return profile_of_walk(walk) if len(walk) else None


def packed_statistics(statistics: Grader | None = None) -> dict[str, Any]:
    """Packs what `hobble.gait.limp_grade` learnt from people's walks. A walk has D features.

    statistics: by default those learnt from all people.

    In the result, `features`: names of the features. `strengths`: the strengths of a limp that are tried; 1
    is the mean strength of people's limps. `healthySpread`: (D, D) covariance of healthy walks. `kinds`: a
    list with an entry for each kind of limp. A kind has a `label`, such as "antalgic", and a `side`: "left",
    "right", or the direction in which the trunk leans. An entry also has the kind in `words` for the page,
    the `mean` (D,) of the features at strength 1, and their covariance `spread` (D, D). Arrays are float64
    in base64.
    """
    statistics = statistics or grader_of_all_people()
    normal = read_people().normal_profile()
    return {
        "features": list(features(normal, normal)),  # any two profiles do: only the names are used
        "strengths": STRENGTHS.tolist(),
        "healthySpread": to_base64(statistics.healthy),
        "kinds": [
            {
                "label": label,
                "side": side,
                "words": kind_in_words(label, side),
                "mean": to_base64(mean),
                "spread": to_base64(spread),
            }
            for (label, side), (mean, spread) in statistics.kinds.items()
        ],
    }


def kind_in_words(label: str, side: str) -> str:
    """What may hurt, such as "left thigh, shank or foot" or "back, leaning forward".

    label, side: a key of `Grader.kinds`.
    """
    parts = PARTS[label]
    parts_in_words = parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} or {parts[-1]}"
    return f"{parts_in_words}, leaning {side}" if label == LEANING else f"{side} {parts_in_words}"
