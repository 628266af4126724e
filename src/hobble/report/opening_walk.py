"""The figures at the top of the page. They already walk when it opens, so it has nothing to compute first."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.report.hero import first_shown, opening
from hobble.report.straight_walk import walk_straight
from hobble.runtime.options import Runtime

FRAMES = 120  # of walking before the page opens: two seconds, enough to reach the speed and to begin to limp

# Fields of `hobble.runtime.character.Character` that are flat lists in the page, with names in camel case.
FLAT = (
    "gait",
    "ground",
    "joint_position",
    "joint_velocity",
    "joint_rotation",
    "channel_values",
    "channel_targets",
    "memory",
)
# Fields that are nested lists or numbers in the page.
NESTED = (
    *("root_height", "phase", "smoothed_velocity", "smoothed_direction", "strafe", "correction", "placed"),
    *("foot_lock", "foot_hold", "foot_step", "foot_missed", "foot_lift", "foot_added"),
    *("leg_shown", "body_lift"),
)


def opening_walk(
    network: Network, runtime: Runtime, playable: Mapping[str, Any], measured: Iterable[Mapping[str, Any]]
) -> dict[str, Any]:
    """The result of `hero.opening`, with the states of one or two figures under `walked`.

    The figures have walked straight on for FRAMES frames on flat ground. The first one has the value of the
    slider. The second one has no value; it is there only if there is a slider. Names and units are those of
    state.js.
    """
    found, one = opening(playable, measured), first_shown(playable)
    if one is None:
        return found | {"walked": [_state(network, runtime, {})]}
    column = one["columns"][one["sliders"][found["part"]]]
    hurt = {one["name"]: {column: found["value"] / 10 * one["highest"]}}
    return found | {"walked": [_state(network, runtime, channels) for channels in (hurt, {})]}


def _state(network: Network, runtime: Runtime, channels: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    *_, (animation, pose) = walk_straight(network, runtime, FRAMES, channels)
    state = animation.state
    out = {_camel_case(name): _plain(np.ravel(getattr(state, name)[0])) for name in FLAT}
    out |= {_camel_case(name): _plain(getattr(state, name)[0]) for name in NESTED}
    for axis, (place, facing) in enumerate((("px", "dx"), ("pz", "dz"))):
        out[place], out[facing] = _plain(state.position[0, :, axis]), _plain(state.direction[0, :, axis])
    out["posePosition"] = _plain(np.ravel(pose.positions))
    out["poseRotation"] = _plain(np.ravel(pose.rotations))
    return out | {"contacts": _plain(pose.contacts), "root": _plain(pose.root)}


def _camel_case(name: str) -> str:
    first, *others = name.split("_")
    return first + "".join(map(str.title, others))


def _plain(values: ArrayLike | Array) -> Any:
    """Nested lists, a number or a bool, with five digits after the point."""
    array = np.asarray(values)
    return array.tolist() if array.dtype == bool else np.round(array.astype(float), 5).tolist()
