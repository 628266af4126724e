"""The rule for a frame. Compiled and plain callers get the same results."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from numba import njit

from hobble.runtime import controller, network_rows, rule


def test_places_standing_and_phase_follow_the_formulas() -> None:
    assert rule.joint_place(2.0, 5.0) == 3.5
    assert [rule.movement_share(s) for s in (0.0, 0.9375, 1.0, 1.5)] == [1.0, 0.5, 0.0, 0.0]
    assert rule.phase_change(0.0, 2.0) == pytest.approx(0.2)
    assert rule.phase_change(1.0, 2.0) == pytest.approx(2.0)


def test_the_rule_is_the_same_compiled_and_in_python() -> None:
    rng = np.random.default_rng(0)

    @njit
    def compiled(a: float, b: float) -> tuple[float, float, float]:
        return network_rows.joint_place(a, b), controller.movement_share(a), controller.phase_change(a, b)

    for a, b in rng.random((100, 2)):
        assert compiled(a, b) == (rule.joint_place(a, b), rule.movement_share(a), rule.phase_change(a, b))
    a, b = torch.rand(2, 50, generator=torch.Generator().manual_seed(0))
    np.testing.assert_array_equal(rule.joint_place(a, b).numpy(), rule.joint_place(a.numpy(), b.numpy()))
