"""The trained network, packed to run in the page: weights as 16-bit integers, and all it needs to know."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np

from hobble.core.skeleton import Skeleton
from hobble.models.network import Network, inverse
from hobble.models.packing import packed
from hobble.report.body import body
from hobble.runtime import animation, feet, trajectory
from hobble.runtime.options import Runtime

# Parts of the body that have a slider and a key of their own: label, roles of the ends, key.
PARTS = (
    ("left thigh", "left_hip", "left_knee"),
    ("left shank", "left_knee", "left_heel"),
    ("left foot", "left_heel", "left_toe"),
    ("right thigh", "right_hip", "right_knee"),
    ("right shank", "right_knee", "right_heel"),
    ("right foot", "right_heel", "right_toe"),
    ("lower back", "hips", "spine"),
    ("left upper arm", "left_shoulder", "left_elbow"),
    ("right upper arm", "right_shoulder", "right_elbow"),
)
PRESETS = {
    "Hurt knee": {"left thigh": 7, "left shank": 7},
    "Sprained ankle": {"right shank": 6, "right foot": 8},
    "Bad back": {"lower back": 8},
    "Knee and back": {"left thigh": 7, "left shank": 7, "lower back": 7},
}


def playable(network: Network, runtime: Runtime) -> dict[str, Any]:
    """What the page's second implementation of the runtime needs; {} where the network has no skeleton.

    Joint rotations are left out of the outputs: the page draws
    positions only.
    """
    skeleton = network.skeleton
    if skeleton is None:
        return {}
    layout = network.layout
    outputs = layout.y_joint_rotation.start
    legs = feet.leg_joints(skeleton)
    parts = body_parts(skeleton, network.links, network.hurt_links)
    sole = feet.sole_heights(network, legs).tolist()
    return {
        "network": {"kind": network.kind, **network.page(outputs)},
        "xMean": packed(network.x_mean.astype(np.float32)),
        "xScale": packed(inverse(network.x_std).astype(np.float32)),
        "yMean": packed(network.y_mean[:outputs].astype(np.float32)),
        "yStd": packed(network.y_std[:outputs].astype(np.float32)),
        "joints": layout.joints,
        "names": list(skeleton.joints),
        "parents": list(skeleton.parents),
        "offsets": np.round(skeleton.offsets, 4).tolist(),
        "window": layout.window,
        "step": layout.step,
        "x": {name: block.start for name, block in layout.blocks("x").items()} | {"size": layout.x_size},
        "y": {name: block.start for name, block in layout.blocks("y").items()},
        "gaits": list(network.gaits),
        "links": list(network.links),
        "trained": list(network.hurt_links),
        "legs": legs.tolist(),
        "carried": [np.flatnonzero(row).tolist() for row in feet.carried(skeleton, legs)],
        "sole": sole,
        "body": {**body(skeleton.joints, skeleton.parents, skeleton.roles, network.links), "sole": sole},
        "severityStep": runtime.rates.get("injury", 10.0) / 60,
        "severityScale": runtime.scales.get("injury", 1.0),
        "footLocking": runtime.foot_locking,
        "steering": runtime.steering,
        "parts": parts,
        "presets": [
            {"name": name, "severities": [[parts[label], value] for label, value in values.items()]}
            for name, values in PRESETS.items()
            if all(label in parts for label in values)
        ],
        "constants": {**_constants(), "side": network.terrain_side},
    }


def body_parts(skeleton: Skeleton, links: Sequence[str], hurt: Collection[str] = ()) -> dict[str, int]:
    """Label -> index of the link that the part is, for those that the network knows.

    Of the links between the part's two ends it is the uppermost of those that were `hurt` in training, or the
    uppermost of all where none was: hurting another would change nothing.
    """
    found = {}
    for label, upper, lower in PARTS:
        if upper not in skeleton.roles or lower not in skeleton.roles:
            continue
        joint, top = skeleton.role(lower), skeleton.role(upper)
        way = []
        while joint != top and skeleton.parents[joint] >= 0:
            way.append(f"{skeleton.joints[skeleton.parents[joint]]}-{skeleton.joints[joint]}")
            joint = skeleton.parents[joint]
        known = [name for name in reversed(way) if name in links]
        if known:
            best = next((name for name in known if name in hurt), known[0])
            found[label] = list(links).index(best)
    return found


def _constants() -> dict[str, float]:
    """The numbers of the Python runtime, so that they stand in one place."""
    return {
        "targetMix": trajectory.TARGET_MIX,
        "gaitMix": trajectory.GAIT_MIX,
        "still": trajectory.STILL,
        "steeringLimit": trajectory.STEERING_LIMIT,
        "owedRate": trajectory.OWED_RATE,
        "owedWithin": trajectory.OWED_WITHIN,
        "mostOwed": trajectory.MOST_OWED,
        "held": trajectory.HELD,
        "furthestTurn": float(trajectory.FURTHEST_TURN),
        "strafeFrom": float(animation.STRAFE_FROM),
        "turnInPlace": float(animation.TURN_IN_PLACE),
        "jogFrom": animation.JOG_FROM,
        "lockAt": feet.LOCK_AT,
        "release": feet.RELEASE,
        "tooFar": feet.TOO_FAR,
        "heightMix": feet.HEIGHT_MIX,
        "floating": feet.FLOATING,
    }
