"""A world that is tilted is refused, and a body that leans or a ground that slopes is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.clip import Clip
from hobble.core.errors import InputError
from hobble.motion.ground import world_tilt
from hobble.motion.physics import find_balance

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
    assert world_tilt(turned(walk, X, 12.0)) == pytest.approx(12.0, abs=1.5)
    assert world_tilt(turned(walk, Z, 20.0)) == pytest.approx(20.0, abs=3.0)


def sloped(clip: Clip, degrees: float) -> Clip:
    """The clip on ground that goes up: each joint is moved upward by its own way ahead."""
    at = clip.positions + clip.positions[..., 2:] * [0.0, np.tan(np.radians(degrees)), 0.0]
    parents = [max(p, 0) for p in clip.skeleton.parents]
    none = np.broadcast_to(quat.IDENTITY, clip.rotations.shape)
    return replace(clip, rotations=none, root=at[:, 0], translations=at - at[:, parents])


# The made-up walk balances 5 degrees forward of its feet, so on 8 degrees down it would look tilted.
@pytest.mark.parametrize("degrees", [-14.0, 8.0])
def test_a_real_slope_is_no_tilt(walk, degrees):
    assert world_tilt(sloped(walk, degrees)) is None


@pytest.mark.parametrize("degrees", [-6.0, 6.0, 10.0])
def test_a_tilt_to_the_side_shows_in_the_balance_alone(walk, degrees):
    """Both feet on one line show no ground."""
    legs = [walk.skeleton.role(f"{side}_hip") for side in ("left", "right")]
    line = walk.skeleton.offsets.copy()
    line[legs, 0] = 0.0
    narrow = replace(walk, skeleton=replace(walk.skeleton, offsets=line))
    assert world_tilt(narrow) is None
    assert world_tilt(turned(narrow, Z, degrees)) == pytest.approx(abs(degrees), abs=1.0)


def test_balance_turns_with_the_world_and_stays_on_a_slope(walk):
    plain = find_balance(walk)
    assert abs(plain.aside) < 0.5
    assert find_balance(turned(walk, Z, 6.0)).aside == pytest.approx(plain.aside - 6.0, abs=0.5)
    assert find_balance(sloped(walk, 6.0)).up == pytest.approx(plain.up, abs=0.02)


def test_a_figure_that_does_not_step_shows_no_balance(walk):
    still = replace(walk, rotations=walk.rotations[:1].repeat(60, 0), root=walk.root[:1].repeat(60, 0))
    assert find_balance(still) is None


@pytest.mark.shared
@pytest.mark.parametrize("name", ["07_01", "16_11", "105_16", "105_03"])
@pytest.mark.parametrize("degrees", [-8.0, 8.0])
def test_a_captured_walk_tilted_to_the_side_is_refused(shared, make, name, degrees):
    clip, _ = make(shared / f"mocap/cmu/{name}.bvh")
    ahead = clip.root[-1] - clip.root[0]
    assert world_tilt(clip) is None
    assert world_tilt(turned(clip, ahead / np.linalg.norm(ahead), degrees)) == pytest.approx(8.0, abs=2.5)


def test_a_trunk_that_leans_aside_is_no_tilt(walk):
    rotations = walk.rotations.copy()
    spine = walk.skeleton.role("spine")
    rotations[:, spine] = quat.mul(quat.from_axis_angle(Z, 0.35), rotations[:, spine])
    assert world_tilt(replace(walk, rotations=rotations)) is None


def test_the_walk_itself_is_not_tilted(walk):
    assert world_tilt(walk) is None
