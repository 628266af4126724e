"""Rounds the weights of a character to 8 bits, for a page that has to hold several characters."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from hobble.core.quat import Array
from hobble.models.network import Network
from hobble.models.packing import packed
from hobble.report.straight_walk import walk_straight
from hobble.runtime.options import Runtime

GROUP = 64  # this many weights of a row share a factor; with one factor for a whole row the error doubles
MOST_INTEGER = 127  # largest integer that stands for a weight
WARM_UP, MEASURED = 60, 180  # frames of walking to get up to speed, and frames that are measured


def rounded(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The data of `hobble.report.playable` with weights of 8 bits instead of 16.

    A network without layers of weights, such as motion matching, stays as it is.
    """
    network = {
        key: [_layer(layer) for layer in value] if _are_layers(value) else value
        for key, value in spec["network"].items()
    }
    return {**spec, "network": network}


def has_weights(spec: Mapping[str, Any]) -> bool:
    """Whether `rounded` changes this character."""
    return any(map(_are_layers, spec["network"].values()))


def rounding_error(network: Network, runtime: Runtime) -> float:
    """The mean distance by which 8-bit weights move a predicted joint, cm, over 3 s of a walk.

    The network must have weights: `has_weights` must be true for its data from `hobble.report.playable`.
    """
    weights: Any = network.weights  # type: ignore[attr-defined]
    restored = type(weights)(_of_groups(*_in_groups(w), w.shape) for w in weights)
    small = replace(network, weights=restored)  # type: ignore[call-arg]
    rows, phases, phase_before = [], [], 0.0
    for frame, (animation, _) in enumerate(walk_straight(network, runtime, WARM_UP + MEASURED, {})):
        if frame >= WARM_UP:
            rows.append(animation.last_inputs[0].copy())
            phases.append(phase_before)
        phase_before = float(animation.state.phase[0])
    x, phase = np.array(rows), np.array(phases)
    off = (small.predict(x, phase) - network.predict(x, phase))[:, network.layout.y_joint_position]
    return float(np.linalg.norm(off.reshape(len(x), -1, 3), axis=-1).mean())


def _are_layers(value: Any) -> bool:
    """Whether an entry of the network's data is a list of layers with weights."""
    return isinstance(value, list) and bool(value) and isinstance(value[0], dict) and "biases" in value[0]


def _layer(packed_layer: Mapping[str, Any]) -> dict[str, Any]:
    """A layer from `hobble.models.packing.packed_rows`, with 8 bits, and a factor for each GROUP of a row."""
    shape = packed_layer["points"], packed_layer["rows"], packed_layer["columns"]
    integers = np.frombuffer(base64.b64decode(packed_layer["weights"]), "<i2").reshape(shape)
    scale = np.frombuffer(base64.b64decode(packed_layer["scale"]), "<f4").reshape(*shape[:2], 1)
    small, factors = _in_groups(integers * scale)
    return {
        **packed_layer,
        "bits": 8,
        "group": GROUP,
        "weights": packed(small.reshape(*shape[:2], -1)[..., : shape[2]]),
        "scale": packed(factors),
    }


def _in_groups(weights: Array) -> tuple[Array, Array]:
    """Weights (..., columns) as integers (..., groups, GROUP), padded with 0, and factors (..., groups)."""
    groups = -(-weights.shape[-1] // GROUP)
    whole = np.zeros((*weights.shape[:-1], groups * GROUP))
    whole[..., : weights.shape[-1]] = weights
    whole = whole.reshape(*weights.shape[:-1], groups, GROUP)
    factors = np.maximum(np.abs(whole).max(axis=-1) / MOST_INTEGER, 1e-30).astype(np.float32)
    return np.round(whole / factors[..., None]).astype(np.int8), factors


def _of_groups(integers: Array, factors: Array, shape: tuple[int, ...]) -> Array:
    """The weights of this shape, from the result of `_in_groups`."""
    whole = (integers * factors[..., None]).reshape(*shape[:-1], -1)
    return np.ascontiguousarray(whole[..., : shape[-1]], np.float32)
