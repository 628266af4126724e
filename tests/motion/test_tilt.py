"""A world that is tilted is refused, and a body that leans or a ground that slopes is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.motion.tilt import tilt

X, Z = np.eye(3)[0], np.eye(3)[2]


def turned(clip: Clip, axis: np.ndarray, degrees: float) -> Clip:
    turn = quat.from_axis_angle(axis, np.radians(degrees))
    rotations = clip.rotations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    return replace(clip, rotations=rotations, root=quat.rotate(turn, clip.root))


@pytest.mark.parametrize("axis", [X, Z, np.array([0.6, 0.0, 0.8])])
@pytest.mark.parametrize("degrees", [-25.0, -12.0, 12.0, 25.0])
def test_a_tilted_world_is_refused(bvh, walk, make, axis, degrees):
    path = bvh(turned(walk, axis, degrees), "tilted")
    with pytest.raises(InputError, match=r"tilted by \d+ degrees"):
        make(path)


def test_the_size_of_the_tilt_is_found(walk):
    assert tilt(turned(walk, X, 12.0)) == pytest.approx(12.0, abs=1.5)
    assert tilt(turned(walk, Z, 20.0)) == pytest.approx(20.0, abs=3.0)


@pytest.mark.parametrize("degrees", [-8.0, 8.0])
def test_a_real_slope_is_no_tilt(walk, degrees):
    """On a slope the feet go up and the body stays upright."""
    slope = np.tan(np.radians(degrees))
    assert tilt(replace(walk, root=walk.root + np.outer(walk.root[:, 2], [0.0, slope, 0.0]))) is None


def test_a_trunk_that_leans_aside_is_no_tilt(walk):
    rotations = walk.rotations.copy()
    spine = walk.skeleton.role("spine")
    rotations[:, spine] = quat.mul(quat.from_axis_angle(Z, 0.35), rotations[:, spine])
    assert tilt(replace(walk, rotations=rotations)) is None


def test_the_walk_itself_is_not_tilted(walk):
    assert tilt(walk) is None
