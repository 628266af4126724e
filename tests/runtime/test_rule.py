"""The rule for a frame. Compiled and plain callers get the same results."""

from __future__ import annotations

import pytest

from hobble.runtime import rule


def test_places_standing_and_phase_follow_the_formulas() -> None:
    assert rule.joint_place(2.0, 5.0) == 3.5
    assert [rule.movement_share(s) for s in (0.0, 0.9375, 1.0, 1.5)] == [1.0, 0.5, 0.0, 0.0]
    assert rule.phase_change(0.0, 2.0) == pytest.approx(0.2)
    assert rule.phase_change(1.0, 2.0) == pytest.approx(2.0)
