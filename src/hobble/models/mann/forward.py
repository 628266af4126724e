"""The mode-adaptive network in plain numpy: start reading here (Zhang, Starke, Komura, Saito 2018).

The network consists of K experts: each layer has K sets of weights. A second, small network, the gate, gets
some columns x' of the input x: velocities of the feet, gait and target velocity. From these it computes K
shares c, in which the outputs of the experts are blended. The phase is not used.

    c = softmax(V2 elu(V1 elu(V0 x' + d0) + d1) + d2)
    h1 = elu(sum_k c_k (W0_k x + b0_k))    ...    y = sum_k c_k (W2_k h2 + b2_k)

W and b are the weights and biases of the experts, V and d those of the gate. Other modules of this folder
compute the same: `step` and `fused` with the gradient, for training; `predictor` fast, for one character or
a crowd; `onnx_export` and `network.js` for other programs.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hobble.core.quat import Array
from hobble.core.skeleton import Skeleton
from hobble.rows.layout import GAITS, RowLayout

FEET = ("left_heel", "left_toe", "right_heel", "right_toe")  # roles of the joints
GATE_INPUTS = 3 * len(FEET) + 2 * len(GAITS) + 2  # number of the columns that `gate_columns` returns


def gate_columns(layout: RowLayout, skeleton: Skeleton) -> tuple[int, ...]:
    """The columns of X that the gate gets.

    These are the velocities of heels and toes, the gait now and at the end of the trajectory, and the
    position of the end of the trajectory, which depends on the target velocity.
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
    """Standardised outputs (n, Y) of standardised inputs z (n, X), both float32.

    z is the x of the formulas above. weights: (K, out, in) for each layer of the experts; biases: (K, out)
    for each. gate_weights: (out, in) for each layer of the gate; gate_biases: (out,) for each. columns: (G,)
    the columns of z that the gate gets.
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
    """Shares (n, K), which are positive and sum to 1, in proportion to e^logits. logits: (n, K)."""
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    return powers / powers.sum(axis=1, keepdims=True)
