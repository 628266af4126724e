"""The characters at the top of the page, which already walk when it opens.

Their first steps are computed here, so that the page does not have to compute them before it shows them.
"""

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

FRAMES = 120  # frames of walking before the page opens: two seconds, enough to get up to speed and to limp

# Fields of `hobble.runtime.character.Character` that are flat lists in the page, under names in camel case.
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
    """The slider that is set when the page opens, and the states of the characters under `walked`.

    playable, measured: the arguments of `hobble.report.hero.opening`, which chooses the slider.

    The characters have walked straight on for FRAMES frames on flat ground. If there is a slider, there are
    two: one with its value, then one without any value. Otherwise there is only the one without. Names and
    units of a state are those of state.js.
    """
    chosen, channel = opening(playable, measured), first_shown(playable)
    if channel is None:
        return chosen | {"walked": [_state(network, runtime, {})]}
    column = channel["columns"][channel["sliders"][chosen["part"]]]
    hurt = {channel["name"]: {column: chosen["value"] / 10 * channel["highest"]}}
    return chosen | {"walked": [_state(network, runtime, channels) for channels in (hurt, {})]}


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
