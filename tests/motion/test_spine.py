"""Bones of trunk and neck get the directions of the target's spine, even if the rig lacks joints."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.motion.body_sample import Target, spine_shares

POINTS = np.array([[0.0, 0, 0], [0, 10, -2], [0, 20, -2], [0, 30, 0], [0, 40, 4]])
SPINE = Target(np.array([0.0, 0.5, 1.0, 1.5, 2.0]), POINTS)


def between(a: int, b: int) -> np.ndarray:
    way = POINTS[b] - POINTS[a]
    return way / np.linalg.norm(way)


@pytest.mark.parametrize(
    ("start", "end", "points"),
    [
        (0.0, 0.5, (0, 1)),
        (0.5, 1.0, (1, 2)),
        (1.0, 1.5, (2, 3)),
        (1.5, 2.0, (3, 4)),
        (0.0, 1.0, (0, 2)),  # no joint between hips and chest
        (1.0, 2.0, (2, 4)),  # no neck
        (0.4, 0.9, (1, 2)),  # the same number of joints at other heights
        (0.0, 2.0, (0, 4)),  # hips that carry the arms
        (0.85, 1.0, (1, 2)),  # a joint just below the chest is not the chest
    ],
)
def test_a_bone_turns_as_the_target_bones_that_it_replaces(start, end, points):
    assert SPINE.direction(start, end) == pytest.approx(between(*points))


def test_spine_shares_are_1_at_the_chest_and_2_at_the_head():
    assert spine_shares(np.array([10.0, 30.0, 5.0, 5.0]), 2) == pytest.approx([0, 0.25, 1, 1.5, 2])
    assert spine_shares(np.array([6.0, 6.0]), 0) == pytest.approx([0, 1.5, 2])
