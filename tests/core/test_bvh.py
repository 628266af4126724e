"""A clip written as BVH is read back as the same motion."""

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.bvh import write_bvh
from hobble.core.clip import Clip
from hobble.motion.read import decode_channels, read_bvh


@pytest.fixture
def clip(holden31):
    rng = np.random.default_rng(5)
    rotations = quat.normalize(rng.normal(size=(20, 31, 4)))
    return Clip("tumble", holden31, 60.0, rotations, rng.normal(size=(20, 3)) * 100)


@pytest.mark.parametrize("order", ["XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"])
def test_every_rotation_order_round_trips(tmp_path, clip, order):
    write_bvh(tmp_path / "a.bvh", clip, order=order, decimals=8)
    file = read_bvh(tmp_path / "a.bvh")
    assert file.names == clip.skeleton.joints
    assert file.parents == clip.skeleton.parents
    assert file.channels[1] == tuple(f"{axis}rotation" for axis in order)
    back, _ = decode_channels(file)
    assert quat.angle(back.rotations, clip.rotations).max() < 1e-6
    np.testing.assert_allclose(back.root, clip.root, atol=1e-7)
    np.testing.assert_allclose(file.offsets, clip.skeleton.offsets, atol=1e-6)
    assert file.frame_time == pytest.approx(1 / 60, abs=1e-8)
    assert file.end_sites["Head"] == [(0.0, 11.0, 0.0)]


def test_joint_translations_are_written_as_six_channels(tmp_path, clip):
    moved = np.tile(clip.skeleton.offsets, (20, 1, 1))
    moved[:, 5] += np.linspace(0, 3, 20)[:, None]
    moving = Clip("m", clip.skeleton, 60.0, clip.rotations, clip.root, moved)
    write_bvh(tmp_path / "a.bvh", moving, decimals=8)
    back, _ = decode_channels(read_bvh(tmp_path / "a.bvh"))
    assert back.translations is not None
    np.testing.assert_allclose(back.translations[:, 5], moved[:, 5], atol=1e-6)
