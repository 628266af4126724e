"""A trained network's output for many rows at once, in plain numpy; any number of layers and joints."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hobble.core.errors import InputError
from hobble.core.files import load_npz
from hobble.core.quat import Array
from hobble.database.layout import RowLayout

BINS = 50  # phases for which the original stores its weights in its constant mode


@dataclass(frozen=True)
class Weights:
    """What network/weights.npz holds: weights (K, out, in), biases (K, out) of K control points a layer."""

    weights: tuple[Array, ...] = field(repr=False)
    biases: tuple[Array, ...] = field(repr=False)
    x_mean: Array = field(repr=False)
    x_std: Array = field(repr=False)
    y_mean: Array = field(repr=False)
    y_std: Array = field(repr=False)
    meta: Mapping[str, Any] = field(repr=False)

    @property
    def layout(self) -> RowLayout:
        """Columns of its input and output."""
        return RowLayout.from_dict(self.meta["layout"])


def load_weights(path: str | Path) -> Weights:
    """Read network/weights.npz; raises InputError where it is damaged or lacks an array."""
    data = load_npz(path)
    try:
        layers = sum(name.startswith("W") for name in data)
        return Weights(
            tuple(data[f"W{i}"] for i in range(layers)),
            tuple(data[f"b{i}"] for i in range(layers)),
            *(data[name] for name in ("Xmean", "Xstd", "Ymean", "Ystd")),
            meta=json.loads(str(data["meta"])) if "meta" in data else {},
        )
    except (KeyError, ValueError) as error:
        raise InputError(path, f"not a network's weights ({error})") from error


def phase_shares(phase: Array, points: int) -> Array:
    """(n, points) share of each control point at phases (n,) in 0..1: a cyclic cubic Catmull-Rom spline."""
    place = np.asarray(phase, np.float64) * points
    index = np.floor(place).astype(int)
    t = (place - index)[:, None]
    cubic = np.concatenate(
        [
            -0.5 * t + t**2 - 0.5 * t**3,
            1 - 2.5 * t**2 + 1.5 * t**3,
            0.5 * t + 2 * t**2 - 1.5 * t**3,
            -0.5 * t**2 + 0.5 * t**3,
        ],
        axis=1,
    )
    shares = np.zeros((len(place), points))
    rows = np.arange(len(place))
    for k in range(4):
        shares[rows, (index + k - 1) % points] += cubic[:, k]
    return shares


def predict(network: Weights, x: Array, phase: Array, constant: bool = False) -> Array:
    """Y (n, Y) in raw units, float32, from raw X (n, X) and phases (n,) in 0..1.

    sum_k c_k(phase) (W_k h + b_k), which equals blending the weights first. constant: with the weights of the
    phase's bin of 50, as the original's constant mode looks them up, instead of those of the phase itself.
    """
    if constant:
        # in single precision, as the original does: in double, 0.24 stored as float32 falls into bin 11
        phase = np.minimum(np.floor(np.asarray(phase, np.float32) * np.float32(BINS)), BINS - 1) / BINS
    shares = phase_shares(phase, len(network.weights[0])).astype(np.float32)
    h = (np.asarray(x, np.float32) - network.x_mean) / network.x_std
    last = len(network.weights) - 1
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        out = shares @ bias
        for k in range(len(weight)):
            out += shares[:, k : k + 1] * (h @ weight[k].T)
        h = out if layer == last else np.where(out > 0, out, np.expm1(np.minimum(out, 0)))
    return h * network.y_std + network.y_mean
