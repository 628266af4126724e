"""Computes the first two seconds of walking of the characters at the top of the report page.

So they already walk when the page opens, and the page does not have to compute these frames first.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.report.opening_slider import opening_channel, opening_slider
from hobble.report.straight_walk import walk_straight
from hobble.runtime.options import Runtime

FRAMES = 120  # frames of walking before the page opens: two seconds, enough to get up to speed and to limp

# Fields of `hobble.runtime.character.Character` that the page has as flat lists, with names in camel case.
FLAT_FIELDS = (
    "gait",
    "ground",
    "joint_position",
    "joint_velocity",
    "joint_rotation",
    "channel_values",
    "channel_targets",
    "memory",
)
# Fields that the page has as nested lists or as numbers, also with names in camel case.
NESTED_FIELDS = (
    *("root_height", "phase", "smoothed_velocity", "smoothed_direction", "strafe", "correction", "placed"),
    *("foot_lock", "foot_hold", "foot_step", "foot_missed", "foot_lift", "foot_added"),
    *("leg_shown", "body_lift"),
)


def opening_walk(
    network: Network, runtime: Runtime, playable: Mapping[str, Any], measurements: Iterable[Mapping[str, Any]]
) -> dict[str, Any]:
    """The result of `opening_slider` and, under `walked`, the states of the characters.

    playable, measurements: the arguments of `opening_slider`, which chooses one slider of a channel and its
    value. A channel is a group of inputs of the network, for example one input for each part of the body.

    The characters have walked straight on for FRAMES frames on flat ground. If the network has a channel with
    sliders, there are two characters: the first has the slider's value, in the second all values are 0.
    Otherwise there is only one character. Names and units in a state are those of web/state.js.
    """
    chosen, channel = opening_slider(playable, measurements), opening_channel(playable)
    if channel is None:
        return chosen | {"walked": [_state_after_walk(network, runtime, {})]}
    column = channel["columns"][channel["sliders"][chosen["part"]]]
    # The value is in tenths of the highest value of the channel.
    opening_values = {channel["name"]: {column: chosen["value"] / 10 * channel["highest"]}}
    return chosen | {
        "walked": [_state_after_walk(network, runtime, values) for values in (opening_values, {})]
    }


def _state_after_walk(
    network: Network, runtime: Runtime, channels: Mapping[str, Mapping[str, float]]
) -> dict[str, Any]:
    """The state of a character, for the page, after FRAMES frames. channels: channel -> column -> value."""
    *_, (animation, pose) = walk_straight(network, runtime, FRAMES, channels)  # only the last frame
    state = animation.state
    out = {_camel_case(name): _plain(np.ravel(getattr(state, name)[0])) for name in FLAT_FIELDS}
    out |= {_camel_case(name): _plain(getattr(state, name)[0]) for name in NESTED_FIELDS}
    for axis, (position_key, direction_key) in enumerate((("px", "dx"), ("pz", "dz"))):
        out[position_key] = _plain(state.position[0, :, axis])
        out[direction_key] = _plain(state.direction[0, :, axis])
    out["posePosition"] = _plain(np.ravel(pose.positions))
    out["poseRotation"] = _plain(np.ravel(pose.rotations))
    return out | {"contacts": _plain(pose.contacts), "root": _plain(pose.root)}


def _camel_case(name: str) -> str:
    first, *others = name.split("_")
    return first + "".join(map(str.title, others))


def _plain(values: ArrayLike | Array) -> Any:
    """`values` as nested lists, a number or a bool. Numbers have at most five digits after the point."""
    array = np.asarray(values)
    return array.tolist() if array.dtype == bool else np.round(array.astype(float), 5).tolist()
