"""The inputs of the gating network."""

from __future__ import annotations

import numpy as np

from hobble.core.skeleton import Skeleton
from hobble.models.mann.forward import GATE_INPUTS, gate_columns, softmax
from hobble.rows.layout import GAITS, RowLayout


def test_the_gate_reads_feet_gait_and_target_velocity(holden31: Skeleton) -> None:
    """The columns are found by writing a number where each of them should be."""
    layout = RowLayout(len(holden31.joints), channels=(("injury", 30),))
    x = np.zeros(layout.x_size)
    velocity = x[layout.x_joint_velocity].reshape(-1, 3)
    for i, joint in enumerate(("LeftFoot", "LeftToeBase", "RightFoot", "RightToeBase")):
        velocity[holden31.index(joint)] = 1 + 3 * i + np.arange(3)
    gait = x[layout.x_gait].reshape(len(GAITS), layout.samples)
    gait[:, 6], gait[:, 11] = 20 + np.arange(6), 30 + np.arange(6)
    x[layout.x_position].reshape(2, -1)[:, 11] = 40, 41
    columns = gate_columns(layout, holden31)
    assert len(columns) == GATE_INPUTS
    assert x[list(columns)].tolist() == [*range(1, 13), *range(20, 26), *range(30, 36), 40, 41]


def test_shares_sum_to_one_however_large_the_logits() -> None:
    shares = softmax(np.array([[1e4, 0, -1e4], [0, 0, 0]], np.float32))
    np.testing.assert_allclose(shares, [[1, 0, 0], [1 / 3] * 3], atol=1e-7)
