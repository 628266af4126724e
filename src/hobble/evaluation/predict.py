"""A network's output for many rows at once, in plain numpy; any number of layers and control points."""

from __future__ import annotations

import numpy as np

from hobble.core.quat import Array
from hobble.runtime.network import Network, catmull_rom

BINS = 50  # phases for which the original stores its weights in its constant mode


def phase_shares(phase: Array, points: int) -> Array:
    """(n, points) share of each control point at phases (n,) in 0..1."""
    indices, coefficients = catmull_rom(phase, points)
    shares = np.zeros((len(indices), points))
    rows = np.arange(len(indices))
    for point, share in zip(np.asarray(indices, int).T, coefficients.T, strict=True):
        shares[rows, point] += share
    return shares


def predict(network: Network, x: Array, phase: Array, constant: bool = False) -> Array:
    """Y (n, Y) in raw units, float32, from raw X (n, X) and phases (n,) in 0..1.

    sum_k c_k(phase) (W_k h + b_k), which equals blending the weights first. constant: with the weights of
    the phase's bin of 50, as the original's constant mode looks them up, instead of those of the phase.
    """
    if constant:
        # in single precision, as the original does: in double, 0.24 stored as float32 falls into bin 11
        phase = np.minimum(np.floor(np.asarray(phase, np.float32) * np.float32(BINS)), BINS - 1) / BINS
    shares = phase_shares(phase, network.control_points).astype(np.float32)
    h = (np.asarray(x, np.float32) - network.x_mean) / network.x_std
    last = len(network.weights) - 1
    for layer, (weight, bias) in enumerate(zip(network.weights, network.biases, strict=True)):
        out = shares @ bias
        for k in range(len(weight)):
            out += shares[:, k : k + 1] * (h @ weight[k].T)
        h = out if layer == last else np.where(out > 0, out, np.expm1(np.minimum(out, 0)))
    return h * network.y_std + network.y_mean
