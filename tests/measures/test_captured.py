"""Rows converted back to motion have the path, accelerations and heights of the original motion."""

from dataclasses import replace

import numpy as np
import pytest

from hobble.measures.sample import Drawn, Sample, captured_motion
from hobble.measures.walks import acceleration, in_root_coordinates
from hobble.rows.clip_rows import ClipRows, Excerpt, captured_stretches, save_clip_rows
from hobble.rows.layout import GAITS, RowLayout
from tests.measures.made_up import SKELETON, random_rows

LAYOUT = RowLayout(3, channels=(("injury", 2),))
FRAMES = 50
# A figure of three joints on a curved path.
T = np.arange(FRAMES + 1) / 20
YAW = 0.4 + 0.8 * np.sin(T)
ROOT = np.stack([60 * np.sin(T), 0 * T, 80 * T], axis=1)
SHAPE = np.random.default_rng(1).normal([0.0, 50, 0], 10, (1, 3, 3))
JOINTS = ROOT[:, None] + SHAPE + np.sin(3 * T)[:, None, None] * [[1.0, 2, 3]]


def level(vectors: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """World vectors (..., 3), relative to a root with this yaw."""
    return in_root_coordinates(vectors, np.zeros((*vectors.shape[:-2], 3)), yaw)


@pytest.fixture
def rows() -> ClipRows:
    """Rows as the format defines them. The ground of the first fit is 3 cm below the world's zero."""
    out, here = random_rows("a", FRAMES, 2, 0, LAYOUT, SKELETON), YAW[:-1]
    y = np.zeros((FRAMES, LAYOUT.y_size))
    y[:, LAYOUT.y_root_velocity] = level(np.diff(ROOT, axis=0)[:, None], here)[:, 0, ::2]
    y[:, LAYOUT.y_turn] = -np.diff(YAW)[:, None]
    y[:, LAYOUT.y_joint_position] = in_root_coordinates(JOINTS[:-1], ROOT[:-1], here).reshape(FRAMES, -1)
    y[:, LAYOUT.y_joint_velocity] = level(np.diff(JOINTS, axis=0), here).reshape(FRAMES, -1)
    gait = out.x[:, LAYOUT.x_gait].reshape(FRAMES, len(GAITS), LAYOUT.samples)
    gait[:] = 0
    gait[:, 2, LAYOUT.samples // 2 :] = 1
    gait[:, 1, : LAYOUT.samples // 2] = 1
    out.x[:, LAYOUT.x_gait] = gait.reshape(FRAMES, -1)
    return replace(out, y=y, mean=np.tile([-3.0, 99.0], FRAMES))


def test_captured_motion_is_recovered_from_its_rows(rows) -> None:
    (found,) = captured_stretches(rows)
    way, joints = level((ROOT[:-1] - ROOT[0])[:, None], np.full(FRAMES, YAW[0]))[:, 0], JOINTS[:-1]
    np.testing.assert_allclose(found.root, way, atol=1e-9)
    np.testing.assert_allclose(found.local[..., 1], joints[..., 1] + 3, atol=1e-9)  # above the ground
    np.testing.assert_allclose(found.acceleration[1:-1], acceleration(joints).max(axis=1), atol=1e-9)
    assert found.acceleration[0] == 0
    assert (found.gait == np.eye(len(GAITS))[2]).all()
    np.testing.assert_allclose(found.velocity, rows.y[:, LAYOUT.y_root_velocity])
    np.testing.assert_array_equal(found.channels["injury"], rows.channels["injury"])


def test_a_gap_in_the_frames_separates_two_stretches(rows, tmp_path) -> None:
    rows.frame[30:] += 2
    first, second = captured_stretches(rows)
    assert (len(first), len(second)) == (30, 20)
    np.testing.assert_allclose(second.root[0], 0)
    assert second.rows[0] == 30
    save_clip_rows(tmp_path / "a.npz", rows)
    part = Sample({"train": Drawn((Excerpt("a", 20, 15, 50),), 2, 100)}, 2)
    assert [len(c) for c in captured_motion({"a": tmp_path / "a.npz"}, part)] == [10, 5]
