"""The figures with which the page opens: they already walk, so that the page has nothing to compute first."""

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

# The fields of character.js with the name that the same array has in the Python state.
ARRAYS = {
    "gait": "gait",
    "ground": "ground",
    "joints": "joint_position",
    "velocities": "joint_velocity",
    "rotations": "joint_rotation",
    "channelValues": "channel_values",
    "channelTargets": "channel_targets",
    "memory": "memory",
}
SMALL = {
    "height": "root_height",
    "phase": "phase",
    "velocity": "smoothed_velocity",
    "direction": "smoothed_direction",
    "strafe": "strafe",
    "correction": "correction",
    "lock": "foot_lock",
    "hold": "foot_hold",
    "step": "foot_step",
    "missed": "foot_missed",
    "lift": "foot_lift",
    "raised": "body_lift",
    "added": "foot_added",
    "shown": "leg_shown",
    "placed": "placed",
}


def opening_walk(
    network: Network, runtime: Runtime, playable: Mapping[str, Any], measured: Iterable[Mapping[str, Any]]
) -> dict[str, Any]:
    """The result of `hero.opening`, with the states of its one or two figures under `walked`.

    They have walked straight on for `FRAMES` frames on flat ground. The first has the value of the slider.
    The second is there if there is a slider, and has no value. Names and units are those of character.js,
    with flat lists for its arrays.
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
    out = {name: _plain(np.ravel(getattr(state, field)[0])) for name, field in ARRAYS.items()}
    out |= {name: _plain(getattr(state, field)[0]) for name, field in SMALL.items()}
    for axis, (place, facing) in enumerate((("px", "dx"), ("pz", "dz"))):
        out[place], out[facing] = _plain(state.position[0, :, axis]), _plain(state.direction[0, :, axis])
    out["pose"], out["turns"] = _plain(np.ravel(pose.positions)), _plain(np.ravel(pose.rotations))
    return out | {"contacts": _plain(pose.contacts), "root": _plain(pose.root)}


def _plain(values: ArrayLike | Array) -> Any:
    """Nested lists, a number or a bool, with five digits after the point."""
    array = np.asarray(values)
    return array.tolist() if array.dtype == bool else np.round(array.astype(float), 5).tolist()
