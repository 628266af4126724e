"""The mode-adaptive network in plain numpy: start reading here (Zhang, Starke, Komura, Saito 2018).

Each layer has K sets of weights, the experts. A small gating network gets some columns x' of the input x:
velocities of the feet, gait and target velocity. It computes the shares c in which the experts are blended
(the phase is not used):

    c = softmax(V2 elu(V1 elu(V0 x' + d0) + d1) + d2)
    h1 = elu(sum_k c_k (W0_k x + b0_k))    ...    y = sum_k c_k (W2_k h2 + b2_k)

Other modules of this folder compute the same: `step` and `fused`, with the gradient, for training;
`predictor`, fast, for one character or a crowd; `onnx_export` and `network.js`, for other programs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.rows.layout import GAITS, RowLayout

FEET = ("left_heel", "left_toe", "right_heel", "right_toe")
GATE_INPUTS = 3 * len(FEET) + 2 * len(GAITS) + 2


def gate_columns(layout: RowLayout, skeleton: Skeleton) -> tuple[int, ...]:
    """The columns of X that the gating network gets.

    These are the velocities of heels and toes, the gait now and at the end of the trajectory, and the end of
    the trajectory, which depends on the target velocity.
    """
    samples, now, last = layout.samples, layout.samples // 2, layout.samples - 1
    feet = [3 * skeleton.role(role) + axis for role in FEET for axis in range(3)]
    gaits = [gait * samples + sample for sample in (now, last) for gait in range(len(GAITS))]
    return (
        *(layout.x_joint_velocity.start + column for column in feet),
        *(layout.x_gait.start + column for column in gaits),
        layout.x_position.start + last,
        layout.x_position.start + samples + last,
    )


def forward(
    weights: Sequence[Array],
    biases: Sequence[Array],
    gate_weights: Sequence[Array],
    gate_biases: Sequence[Array],
    columns: NDArray[np.int64],
    z: Array,
) -> Array:
    """Standardised outputs (n, Y) of standardised inputs z (n, X), the x of the formulas above, float32.

    weights: per layer (K, out, in); biases: per layer (K, out); gate_weights: per layer (out, in);
    gate_biases: per layer (out,). columns: (G,) the columns of z that the gate gets.
    """
    h = z[:, columns]
    for layer, (weight, bias) in enumerate(zip(gate_weights, gate_biases, strict=True)):
        h = elu(h) if layer else h
        h = h @ weight.T + bias
    shares = softmax(h)
    h = z
    for layer, (weight, bias) in enumerate(zip(weights, biases, strict=True)):
        h = elu(h) if layer else h
        h = sum(shares[:, k : k + 1] * (h @ weight[k].T + bias[k]) for k in range(len(weight)))
    return h


def elu(h: Array) -> Array:
    """h where it is above 0, e^h - 1 elsewhere."""
    return np.where(h > 0, h, np.expm1(np.minimum(h, 0)))


def softmax(logits: Array) -> Array:
    """Shares (n, K) that are positive and sum to 1."""
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    return powers / powers.sum(axis=1, keepdims=True)
