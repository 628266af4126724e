"""The phase-functioned network in plain numpy: start reading here (Holden, Komura, Saito 2017).

Each layer has K control points of its weights W and biases b, equally spaced over a cycle of two steps. The
weights and biases at a phase p lie on a cyclic cubic spline through the control points. With two hidden
layers, the output y for the input x is

    h1 = elu(W0(p) x + b0(p))    h2 = elu(W1(p) h1 + b1(p))    y = W2(p) h2 + b2(p)

The other modules of this folder compute the same network. `step` and `fused` also compute the gradient, for
training. `predictor` is fast for one character or a crowd. `onnx_export` writes it for other programs, and
`network.js` runs it in a browser.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hobble.core.quat import Array

# Coefficients of the Catmull-Rom spline. Rows: four neighbouring control points. Columns: powers 0 to 3 of t,
# which is 0 at the second point and 1 at the third.
CATMULL_ROM = 0.5 * np.array([[0, -1, 2, -1], [2, 0, -5, 3], [0, 1, 4, -3], [0, 0, -1, 1]], float)
BINS = 50  # the constant mode of Holden et al. (2017) stores the weights at this many phases


def forward(weights: Sequence[Array], biases: Sequence[Array], z: Array, phase: Array) -> Array:
    """Standardised outputs (n, Y) of standardised inputs z (n, X) at phases (n,), float32.

    weights: (K, out, in) for each layer. biases: (K, out) for each layer. The outputs of the control points
    are blended, sum_k c_k (W_k h + b_k) with shares c_k. Blending weights and biases would give the same.
    """
    shares = phase_shares(phase, len(weights[0])).astype(np.float32)
    h = z
    for layer, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        out = shares @ bias
        for k in range(len(weight)):
            out += shares[:, k : k + 1] * (h @ weight[k].T)
        # Every layer but the last is followed by the ELU: x above 0, else e^x - 1.
        h = out if layer == len(weights) - 1 else np.where(out > 0, out, np.expm1(np.minimum(out, 0)))
    return h


def catmull_rom(phase: Array, points: int) -> tuple[np.ndarray, Array]:
    """The four control points of a cyclic cubic spline at `phase` (...) in cycles, and their coefficients.

    points: K, the number of control points. Returns indices (..., 4) and coefficients (..., 4) in float64
    (Holden et al. 2017, eq. 7).
    """
    scaled = np.mod(np.asarray(phase, float), 1.0) * points
    second = np.floor(scaled).astype(int)  # the control point at or before the phase, second of the four
    t = (scaled - second)[..., None]
    indices = (second[..., None] + np.arange(-1, 3)) % points
    return indices, t ** np.arange(4) @ CATMULL_ROM.T


def phase_shares(phase: Array, points: int) -> Array:
    """(n, points) float64: the share of each control point in the blend at phases (n,) in cycles."""
    indices, coefficients = catmull_rom(np.atleast_1d(phase), points)
    shares = np.zeros((len(indices), points))
    rows = np.arange(len(indices))
    for point, share in zip(np.asarray(indices, int).T, coefficients.T, strict=True):
        shares[rows, point] += share
    return shares


def weights_at(points: Array, phase: Array) -> Array:
    """The values (P, ...) float64 at phases (P,) of splines with the control points `points` (K, ...)."""
    return np.tensordot(phase_shares(phase, len(points)), points.astype(float), 1)


def rounded_to_bins(phase: Array) -> Array:
    """Phases (n,) rounded down to a multiple of 1 / BINS. A phase of 1 is rounded to the last bin, 0.98."""
    # In single precision, as in their program. In double precision, 0.24 stored as float32 would fall into
    # bin 11, not 12.
    return np.minimum(np.floor(np.asarray(phase, np.float32) * np.float32(BINS)), BINS - 1) / BINS
