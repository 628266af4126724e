"""Rounds the weights of a character's network to 8 bits, for a page that has to hold several characters."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.models.packing import to_base64
from hobble.report.straight_walk import walk_straight
from hobble.runtime.options import Runtime

# A weight is stored as an integer times a factor. This many weights of a row share a factor. With one factor
# for a whole row the error doubles.
GROUP = 64
LARGEST_INTEGER = 127
WARM_UP, MEASURED = 60, 180  # frames of walking to get up to speed, and frames that are measured


def round_weights(spec: Mapping[str, Any]) -> dict[str, Any]:
    """A character with weights of 8 bits instead of 16. spec: its data, from `hobble.report.playable`.

    A network without layers of weights, such as motion matching, stays as it is.
    """
    network = {
        key: [_round_layer(layer) for layer in value] if _are_layers(value) else value
        for key, value in spec["network"].items()
    }
    return {**spec, "network": network}


def has_weights(spec: Mapping[str, Any]) -> bool:
    """Whether a character's network has weights, so that `round_weights` changes it."""
    return any(map(_are_layers, spec["network"].values()))


def rounding_error(network: Network, runtime: Runtime) -> float:
    """The mean distance by which 8-bit weights move a predicted joint, cm, over 3 s of a walk.

    The network must have weights: `has_weights` must be true for its data from `hobble.report.playable`.
    """
    weights: Any = network.weights  # type: ignore[attr-defined]
    rounded_weights = type(weights)(_join_groups(*_round_in_groups(w), w.shape) for w in weights)
    rounded_network = replace(network, weights=rounded_weights)  # type: ignore[call-arg]
    # The inputs and phases with which the network is evaluated in the measured frames. A frame is evaluated
    # at the phase that the frame before it ended with.
    rows, phases, phase_before = [], [], 0.0
    for frame, (animation, _) in enumerate(walk_straight(network, runtime, WARM_UP + MEASURED, {})):
        if frame >= WARM_UP:
            rows.append(animation.last_inputs[0].copy())
            phases.append(phase_before)
        phase_before = float(animation.state.phase[0])
    x, phase = np.array(rows), np.array(phases)
    change = (rounded_network.predict(x, phase) - network.predict(x, phase))[
        :, network.layout.y_joint_position
    ]
    return float(np.linalg.norm(change.reshape(len(x), -1, 3), axis=-1).mean())


def _are_layers(value: Any) -> bool:
    """Whether an entry of the network's data is a list of layers with weights."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict) and "biases" in value[0]


def _round_layer(packed_layer: Mapping[str, Any]) -> dict[str, Any]:
    """A layer with weights of 8 bits. packed_layer: from `hobble.models.packing.pack_layer`."""
    shape = packed_layer["points"], packed_layer["rows"], packed_layer["columns"]
    integers = np.frombuffer(base64.b64decode(packed_layer["weights"]), "<i2").reshape(shape)
    scale = np.frombuffer(base64.b64decode(packed_layer["scale"]), "<f4").reshape(*shape[:2], 1)
    small, factors = _round_in_groups(integers * scale)
    return {
        **packed_layer,
        "bits": 8,
        "group": GROUP,
        "weights": to_base64(small.reshape(*shape[:2], -1)[..., : shape[2]]),
        "scale": to_base64(factors),
    }


def _round_in_groups(weights: Array) -> tuple[Array, Array]:
    """Round weights (..., columns) to integers (..., groups, GROUP) times factors (..., groups).

    Returns the integers and the factors. The last group of a row is padded with 0.
    """
    groups = -(-weights.shape[-1] // GROUP)  # rounded up
    padded = np.zeros((*weights.shape[:-1], groups * GROUP))
    padded[..., : weights.shape[-1]] = weights
    padded = padded.reshape(*weights.shape[:-1], groups, GROUP)
    factors = np.maximum(np.abs(padded).max(axis=-1) / LARGEST_INTEGER, 1e-30).astype(np.float32)
    return np.round(padded / factors[..., None]).astype(np.int8), factors


def _join_groups(integers: Array, factors: Array, shape: tuple[int, ...]) -> Array:
    """The rounded weights, in their first shape. integers, factors: from `_round_in_groups`."""
    padded = (integers * factors[..., None]).reshape(*shape[:-1], -1)
    return np.ascontiguousarray(padded[..., : shape[-1]], np.float32)
