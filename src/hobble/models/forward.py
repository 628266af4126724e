"""The networks of the kinds pfnn, mann and plain in plain numpy: start reading here.

All three are blended stacks. Each layer has K sets of weights W_k and biases b_k. For each sample, they are
blended in shares c_k. With two hidden layers, the output y for the input x is

    h1 = elu(sum_k c_k (W0_k x + b0_k))    h2 = elu(sum_k c_k (W1_k h1 + b1_k))
    y = sum_k c_k (W2_k h2 + b2_k)

The kinds differ in where the shares come from:

- pfnn, the phase-functioned network (Holden, Komura, Saito 2017): from the phase p. The sets are control
  points, equally spaced over a cycle of two steps. The weights at p lie on a cyclic cubic spline through
  them: c = `phase_shares`(p).
- mann, the mode-adaptive network (Zhang, Starke, Komura, Saito 2018): from a second, small network, the gate,
  which gets some columns x' of x: c = softmax(V2 elu(V1 elu(V0 x' + d0) + d1) + d2).
- plain, a feed-forward network: there is one set, c = 1. x ends with sine and cosine of the phase.

Other modules compute the same: `predict` fast, for one character or a crowd; `step` with the gradient, for
training; `onnx_file` and `engine/c` for other programs.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from hobble.core.quat import Array


def forward(weights: Sequence[Array], biases: Sequence[Array], shares: Array, h: Array) -> Array:
    """Standardised outputs (n, Y) of standardised inputs h (n, X), float32.

    weights: (K, out, in) of each layer. biases: (K, out) of each layer. shares: (n, K). Outputs of the sets
    are blended here; blending weights and biases would give the same.
    """
    for layer, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        h = elu(h) if layer else h
        out = shares @ bias
        for k in range(len(weight)):
            out += shares[:, k : k + 1] * (h @ weight[k].T)
        h = out
    return h


def elu(h: Array) -> Array:
    """h where it is above 0, e^h - 1 elsewhere."""
    return np.where(h > 0, h, np.expm1(np.minimum(h, 0)))


def softmax(logits: Array) -> Array:
    """Shares (n, K), which are positive and sum to 1, in proportion to e^logits. logits: (n, K)."""
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    return powers / powers.sum(axis=1, keepdims=True)


def catmull_rom(t: Any) -> tuple[Any, Any, Any, Any]:
    """The shares of four neighbouring control points, t of the way from the second to the third, 0 <= t <= 1.

    The cubic spline of Catmull and Rom (Holden et al. 2017, eq. 7). t: a number or an array of any library.
    """
    return (
        ((2 - t) * t - 1) * t / 2,
        ((3 * t - 5) * t * t + 2) / 2,
        ((4 - 3 * t) * t + 1) * t / 2,
        (t - 1) * t * t / 2,
    )


def phase_shares(phase: Any, points: Any) -> Any:
    """(n, K): the share of each of K control points at phases (n,) in cycles, on a cyclic cubic spline.

    points: (K,) the numbers 0 to K - 1. Both are arrays of numpy or tensors of PyTorch. K is 4 or more.
    """
    position = phase % 1.0 * len(points)
    before = position // 1.0  # the control point at or before the phase, second of the four around it
    shares = 0.0
    for place, share in enumerate(catmull_rom(position - before)):
        index = (before + (place - 1)) % len(points)
        shares = shares + share[:, None] * (index[:, None] == points)
    return shares


def weights_at(points: Array, phase: Array) -> Array:
    """The values (P, ...) float64 at phases (P,) of splines with the control points `points` (K, ...)."""
    shares = phase_shares(np.atleast_1d(np.asarray(phase, float)), np.arange(len(points)))
    return np.tensordot(shares, points.astype(float), 1)
