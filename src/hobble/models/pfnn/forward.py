"""The phase-functioned network in plain numpy: start reading here (Holden, Komura, Saito 2017).

Each layer has K control points of its weights, equally spaced over a cycle of two steps. The weights at a
phase lie on a cyclic cubic spline through the control points:

    h1 = elu(W0(p) x + b0(p))    h2 = elu(W1(p) h1 + b1(p))    y = W2(p) h2 + b2(p)

The other modules of this folder compute the same. `step` and `fused` also compute the gradient, for training.
`predictor` is fast for one character or a crowd. `onnx_export` and `network.js` are for other programs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hobble.core.quat import Array

# Rows: four neighbouring control points. Columns: powers 0 to 3 of t, which is 0 at the second point and 1 at
# the third.
CATMULL_ROM = 0.5 * np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1]], float)
BINS = 50  # the constant mode of Holden et al. (2017) stores the weights at this many phases


def forward(weights: Sequence[Array], biases: Sequence[Array], z: Array, phase: Array) -> Array:
    """Standardised outputs (n, Y) of standardised inputs z (n, X) at phases (n,), float32.

    weights: per layer (K, out, in); biases: per layer (K, out). Blending outputs, sum_k c_k (W_k h + b_k),
    equals blending the weights first.
    """
    shares = phase_shares(phase, len(weights[0])).astype(np.float32)
    h = z
    for layer, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        out = shares @ bias
        for k in range(len(weight)):
            out += shares[:, k : k + 1] * (h @ weight[k].T)
        h = out if layer == len(weights) - 1 else np.where(out > 0, out, np.expm1(np.minimum(out, 0)))
    return h


def catmull_rom(phase: Array, points: int) -> tuple[np.ndarray, Array]:
    """The four control points of a cyclic cubic spline at `phase` (...) in cycles, and their coefficients.

    Returns indices (..., 4) and coefficients (..., 4) in float64 (Holden et al. 2017, eq. 7).
    """
    scaled = np.mod(np.asarray(phase, float), 1.0) * points
    first = np.floor(scaled).astype(int)
    t = (scaled - first)[..., None]
    indices = (first[..., None] + np.arange(-1, 3)) % points
    return indices, t ** np.arange(4) @ CATMULL_ROM.T


def phase_shares(phase: Array, points: int) -> Array:
    """(n, points) share of each control point at phases (n,) in cycles."""
    indices, coefficients = catmull_rom(np.atleast_1d(phase), points)
    shares = np.zeros((len(indices), points))
    rows = np.arange(len(indices))
    for point, share in zip(np.asarray(indices, int).T, coefficients.T, strict=True):
        shares[rows, point] += share
    return shares


def weights_at(points: Array, phase: Array) -> Array:
    """Control points (K, ...) blended at phases (P,): (P, ...) float64."""
    return np.tensordot(phase_shares(phase, len(points)), points.astype(float), 1)


def binned(phase: Array) -> Array:
    """Phases (n,) rounded down to the 50 bins of the constant mode of Holden et al. (2017)."""
    # In single precision, as in their program. In double precision, 0.24 stored as float32 would fall into
    # bin 11, not 12.
    return np.minimum(np.floor(np.asarray(phase, np.float32) * np.float32(BINS)), BINS - 1) / BINS
