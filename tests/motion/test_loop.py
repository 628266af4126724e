"""Repeated short cycles go on in one direction, without a jerk at the seams."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.errors import HobbleError
from hobble.motion.edit import loop_clip
from hobble.motion.root import root_frames


@pytest.mark.parametrize("last", [60, 61])
def test_a_looped_cycle_equals_the_longer_walk(walker, holden31, last):
    """One cycle is 60 frames; a 61st that repeats the first is noticed."""
    walk = walker(holden31, 301, 60.0)
    looped = loop_clip(walk.part(slice(last)), 5)
    assert len(looped) == 300
    np.testing.assert_allclose(looped.root[:, 2], walk.root[:300, 2], atol=0.5)
    assert np.linalg.norm(looped.positions - walk.positions[:300], axis=-1).mean() < 1.0


def test_a_cycle_that_turns_goes_on_turning(walker, holden31):
    walk = walker(holden31, 60, 60.0)
    yaw, rotations = np.linspace(0, np.pi / 3, 60), walk.rotations.copy()
    rotations[:, 0] = quat.mul(quat.yaw(yaw), rotations[:, 0])
    way = np.stack([np.sin(yaw), np.zeros(60), np.cos(yaw)], axis=1) * 100 / 60
    curve = replace(walk, rotations=rotations, root=np.cumsum(way, axis=0) + walk.root * [0, 1, 0])
    looped = loop_clip(curve, 6)
    ahead = root_frames(looped, 0).direction
    turned = np.degrees(np.unwrap(np.arctan2(ahead[:, 0], ahead[:, 2])))
    assert turned[-1] - turned[0] == pytest.approx(360, abs=15)
    once, often = (np.linalg.norm(np.diff(c.positions, axis=0), axis=-1).max(axis=1) for c in (curve, looped))
    assert often[59::60].max() <= 1.5 * once.max()


def test_a_data_set_can_ask_for_loops(walk, bvh, make):
    clip, report = make(bvh(walk.part(slice(121))), loops=4)
    assert (len(clip), report["loops"], report["cycle_frames"]) == (240, 4, 60)
    assert "repeated 4 times" in report["repairs"][-1]
    assert clip.root[-1, 2] > 380
    with pytest.raises(HobbleError, match="walk: 2 frames are too few"):
        make(bvh(walk.part(slice(3))), loops=4, accept_doubt=True)
