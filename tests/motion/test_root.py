"""The root frame, compared with the original's rows and with exact cases."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hobble.core import quat
from hobble.core.skeleton import Skeleton
from hobble.motion.root import RootFrames, extend_root, local_pose, root_frames, usual_rotations


@settings(max_examples=15, deadline=None)
@given(angle=st.floats(-3.1, 3.1), shift=st.floats(-500, 500))
def test_rows_do_not_depend_on_place_and_heading(walk, angle, shift):
    clip, turn = walk.part(slice(40)), quat.yaw(angle)
    rotations = clip.rotations.copy()
    rotations[:, 0] = quat.mul(turn, rotations[:, 0])
    root = quat.rotate(turn, clip.root) + np.array([shift, 0, -shift])
    other = replace(clip, rotations=rotations, root=root)
    ours, theirs = root_frames(clip, 5), root_frames(other, 5)
    for a, b in zip(local_pose(clip, ours), local_pose(other, theirs), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-7)
    np.testing.assert_allclose(ours.turn, theirs.turn, atol=1e-9)


@pytest.mark.shared
def test_root_frames_equal_those_of_the_original_rows(shared, make):
    """Frame 95 is the first of the original's rows: line 1 of the footsteps begins at frame 191 at 120 Hz."""
    clip, _ = make(shared / "mocap/pfnn/LocomotionFlat09_000.bvh", proportions="clip")
    rows = np.load(shared / "reference/original_rows_LocomotionFlat09_000.npz")
    n = int(rows["cycle_length"][0])
    x, y = rows["X"][:n], rows["Y"][:n]
    root = root_frames(clip, 20)
    positions, velocities, rotations = local_pose(clip, root)
    frames = slice(95, 95 + n)
    ours = positions[frames][..., [0, 2]], y[:, 32:125].reshape(n, 31, 3)[..., [0, 2]]
    np.testing.assert_allclose(*ours, atol=1e-5)
    np.testing.assert_allclose(velocities[frames], y[:, 125:218].reshape(n, 31, 3), atol=1e-5)
    np.testing.assert_allclose(rotations[frames], y[:, 218:311].reshape(n, 31, 3), atol=1e-6)
    np.testing.assert_allclose(root.turn[frames], y[:, 2], atol=1e-7)
    previous = positions[94 : 94 + n][..., [0, 2]]
    np.testing.assert_allclose(previous, x[:, 120:213].reshape(n, 31, 3)[..., [0, 2]], atol=1e-5)


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_rotation_of_a_forearm_does_not_jump(holden31: Skeleton, side: str) -> None:
    """It turns on in the way in which it came from the T-pose, from 60 to 220 degrees."""
    usual = usual_rotations(holden31)[holden31.role(f"{side}_wrist")]
    axis = quat.log(usual) / np.linalg.norm(quat.log(usual))
    world = quat.from_axis_angle(axis, np.radians(np.linspace(60, 220, 60)))
    assert np.abs(np.diff(quat.log(world, usual), axis=0)).max() < 0.1
    assert np.abs(np.diff(quat.log(world), axis=0)).max() > 1
    np.testing.assert_allclose(quat.exp(quat.log(world, usual)), world, atol=1e-9)


def test_the_root_goes_straight_on_past_both_ends():
    n = np.arange(40.0)
    position = np.stack([2 * n, np.where(n < 20, 0, n - 20)], axis=1)
    position[36] += [30, 30]  # one bad frame near an end is no velocity
    yaw = 0.02 * n
    direction = np.stack([np.sin(yaw), 0 * n, np.cos(yaw)], axis=1)
    root = RootFrames(position, direction, quat.yaw(-yaw), np.full(39, 0.02))
    longer = extend_root(root, 7)
    np.testing.assert_array_equal(longer.position[7:47], root.position)
    k = np.arange(1.0, 8)
    np.testing.assert_allclose(longer.position[47:], np.stack([78 + 2 * k, 19 + k], axis=1))
    np.testing.assert_allclose(longer.position[:7], np.stack([-2 * k[::-1], 0 * k], axis=1), atol=1e-12)
    for name in ("direction", "rotation"):
        held = getattr(root, name)[np.clip(np.arange(-7, 47), 0, 39)]
        np.testing.assert_array_equal(getattr(longer, name), held)
    np.testing.assert_array_equal(longer.turn, np.pad(root.turn, 7))
