"""The trained network, packed to run in the page: weights as 16-bit integers, and all it needs to know."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hobble.core.skeleton import Skeleton
from hobble.figure.mesh import body, key
from hobble.figure.pack import regions
from hobble.models.network import Network, inverse
from hobble.models.packing import packed
from hobble.report.words import PARTS, spoken_links, way
from hobble.rows.layout import RowLayout
from hobble.runtime import animation, controller, feet, trajectory
from hobble.runtime.bounds import Bounds
from hobble.runtime.character import start
from hobble.runtime.limits import LAME_BELOW
from hobble.runtime.options import Runtime

UNSEEN = 1e-7  # an input that is scaled by less than this says nothing
PRESETS = {
    "Hurt knee": {"left thigh": 7, "left shank": 7},
    "Sprained ankle": {"right shank": 6, "right foot": 8},
    "Bad back": {"lower back": 8},
    "Knee and back": {"left thigh": 7, "left shank": 7, "lower back": 7},
}


def playable(network: Network, runtime: Runtime) -> dict[str, Any]:
    """What the page's second implementation of the runtime needs; {} where the network has no skeleton.

    Left out are inputs that weigh nothing (joints that a network is not shown), and the rotations of joints
    that move no part of the body, such as fingers: these stay at rest on the joint above.
    """
    skeleton = network.skeleton
    if skeleton is None:
        return {}
    layout = network.layout
    turning = turning_joints(skeleton)
    rows, scale = _rows(layout, turning), inverse(network.x_std)
    seen = np.flatnonzero(scale > UNSEEN)
    legs = feet.leg_joints(skeleton)
    felt = network.hurt_links  # hurting another would change nothing
    parts = {
        label: i for label, i in body_parts(skeleton, network.links, felt).items() if network.links[i] in felt
    }
    sole = feet.sole_heights(network, legs).tolist()
    return {
        "network": {"kind": network.kind, **network.page(seen, rows)},
        "seen": seen.tolist(),
        "xMean": packed(network.x_mean[seen].astype(np.float32)),
        "xScale": packed(scale[seen].astype(np.float32)),
        "yMean": packed(network.y_mean[rows].astype(np.float32)),
        "yStd": packed(network.y_std[rows].astype(np.float32)),
        "turning": turning,
        "joints": layout.joints,
        "names": list(skeleton.joints),
        "parents": list(skeleton.parents),
        "bounds": _bounds(network, rows),
        "start": _start(network),
        "offsets": np.round(skeleton.offsets, 4).tolist(),
        "roles": dict(skeleton.roles),
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
        "body": key(skeleton),
        "regions": regions(skeleton, network.links),
        "spoken": spoken_links(skeleton, network.links),
        "severityStep": runtime.rates.get("injury", 10.0) / 60,
        "severityScale": runtime.scales.get("injury", 1.0),
        "footLocking": runtime.foot_locking,
        "steering": runtime.steering,
        "limits": network.limits["injury"].to_dict()
        if runtime.limits and "injury" in network.limits
        else None,
        "parts": parts,
        "presets": [
            {"name": name, "severities": [[parts[label], value] for label, value in values.items()]}
            for name, values in PRESETS.items()
            if all(label in parts for label in values)
        ],
        "constants": {**_constants(), "side": network.terrain_side},
    }


def turning_joints(skeleton: Skeleton) -> list[int]:
    """The joints whose rotations are seen: the bones of the body, legs, and all above them."""
    found: set[int] = set()
    for joint in (*body(skeleton).bones.tolist(), *feet.leg_joints(skeleton).ravel().tolist()):
        while joint >= 0 and joint not in found:
            found.add(joint)
            joint = skeleton.parents[joint]
    return sorted(found)


def _rows(layout: RowLayout, turning: Sequence[int]) -> NDArray[np.int64]:
    """Outputs that the page uses: all before the rotations, and those of the joints that turn."""
    start = layout.y_joint_rotation.start
    turns = start + 3 * np.asarray(turning)[:, None] + np.arange(3)
    return np.concatenate([np.arange(start), turns.ravel()])


def skeleton_of(spec: Mapping[str, Any]) -> Skeleton:
    """The skeleton of a character that `playable` packed, as far as its body needs it."""
    joints, parents = tuple(spec["names"]), tuple(spec["parents"])
    return Skeleton("", joints, parents, np.array(spec["offsets"]), spec["roles"])


def body_parts(skeleton: Skeleton, links: Sequence[str], hurt: Collection[str] = ()) -> dict[str, int]:
    """Label -> index of the link that the part is, for those that the network knows.

    Of the links between the part's two ends it is the uppermost of those that were `hurt` in training, or the
    uppermost of all where none was: hurting another would change nothing.
    """
    found = {}
    for label, upper, lower in PARTS:
        known = [name for name in way(skeleton, upper, lower) if name in links]
        if known:
            best = next((name for name in known if name in hurt), known[0])
            found[label] = list(links).index(best)
    return found


def _bounds(network: Network, rows: NDArray[np.int64]) -> dict[str, Any]:
    """What keeps the character whole: `hobble.runtime.bounds`, of the outputs `rows`."""
    found = Bounds.of(network)
    low, high = found.y_low[rows], found.y_high[rows]
    arrays = {"xLow": found.x_low, "xHigh": found.x_high, "yLow": low, "yHigh": high}
    return {name: packed(a.astype(np.float32)) for name, a in arrays.items()} | {"fastest": found.fastest}


def _start(network: Network) -> dict[str, Any]:
    """The state in which a character begins, at the origin and facing ahead."""
    state = start(network, 1, np.zeros((1, 2)), np.zeros(1))
    names = ("position", "direction", "gait", "joint_position", "joint_velocity", "joint_rotation")
    arrays = {name: packed(getattr(state, name)[0].astype(np.float32)) for name in names}
    return {**arrays, "phase": float(state.phase[0])}


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
        "strafeFrom": float(trajectory.STRAFE_FROM),
        "turnInPlace": float(animation.TURN_IN_PLACE),
        "jogFrom": animation.JOG_FROM,
        "lameBelow": LAME_BELOW,
        "lockAt": feet.LOCK_AT,
        "release": feet.RELEASE,
        "tooFar": feet.TOO_FAR,
        "fastestTurn": float(controller.FASTEST_TURN),
        "heightMix": feet.HEIGHT_MIX,
        "floating": feet.FLOATING,
        "mostAdded": feet.MOST_ADDED,
    }
