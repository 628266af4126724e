"""Generated motion as BVH, and the scripted scenarios."""

from pathlib import Path

import numpy as np

from hobble.core import quat
from hobble.core.skeleton import forward_kinematics
from hobble.motion.read import decode_channels, read_bvh
from hobble.runtime.export import export_bvh, fitted_skeleton, motion_clip
from hobble.runtime.feet import leg_joints
from hobble.runtime.options import Runtime
from hobble.runtime.scenarios import generate_scenarios, scenarios


def motion(skeleton, frames: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """World positions and rotations of a skeleton in random motion."""
    rng = np.random.default_rng(2)
    local = quat.exp(rng.normal(0, 0.3, (frames, len(skeleton.joints), 3)))
    rotations, positions = forward_kinematics(skeleton, local, rng.normal(0, 50, (frames, 3)))
    return positions, rotations


def test_toes_reach_their_predicted_positions(holden31) -> None:
    positions, rotations = motion(holden31)
    legs = leg_joints(holden31)
    moved = positions.copy()
    moved[:, legs[:, 3]] += np.random.default_rng(3).normal(0, 1, (len(positions), 2, 3))
    clip = motion_clip("walk", holden31, moved, rotations)
    off = np.linalg.norm(clip.positions[:, legs[:, 3]] - moved[:, legs[:, 3]], axis=-1)
    assert np.median(off) < 1e-6  # all but legs that are stretched further than they are long
    feet, others = legs[:, 2], np.setdiff1d(np.arange(31), legs[:, :2])
    np.testing.assert_allclose(quat.angle(clip.global_rotations[:, feet], rotations[:, feet]), 0, atol=1e-6)
    np.testing.assert_allclose(
        quat.angle(clip.global_rotations[:, others], rotations[:, others]), 0, atol=1e-6
    )


def test_bone_lengths_are_estimated_from_a_motion(holden31) -> None:
    positions, rotations = motion(holden31)
    found = fitted_skeleton(holden31, positions, rotations)
    np.testing.assert_allclose(found.offsets[1:], holden31.offsets[1:], atol=1e-9)


def test_bvh_round_trip(tmp_path: Path, holden31) -> None:
    positions, rotations = motion(holden31)
    export_bvh(tmp_path / "walk.bvh", "walk", holden31, positions, rotations)
    back, _ = decode_channels(read_bvh(tmp_path / "walk.bvh"))
    for j, name in enumerate(holden31.joints):
        at = back.positions[:, back.skeleton.joints.index(name)]
        np.testing.assert_allclose(at, positions[:, j], atol=2e-3)


def test_every_scenario_is_written(tmp_path: Path, hurtable) -> None:
    generate_scenarios(hurtable, tmp_path / "scenarios.npz", tmp_path / "bvh", Runtime())
    data = np.load(tmp_path / "scenarios.npz")
    names = [str(name) for name in data["names"]]
    assert names[:3] == ["walk", "jog", "crouch"]
    assert {"left_knee", "right_knee", "left_ankle", "lower_back", "left_arm"} < set(names)
    assert sorted(p.stem for p in (tmp_path / "bvh").iterdir()) == sorted(names)
    assert data["parents"].tolist() == list(hurtable.skeleton.parents)
    for scenario in scenarios(hurtable):
        positions = data[f"{scenario.name}/positions"]
        assert positions.shape == (scenario.frames, 31, 3)
        assert positions.dtype == np.float32
        assert len(data[f"{scenario.name}/gait"]) == scenario.frames
    knee = data["left_knee/swept_values"]
    assert (knee[0], knee[-1]) == (0, 10)
    assert np.all(np.diff(knee) > 0)
    assert data["left_knee/swept"].tolist() == ["injury", "LeftUpLeg-LeftLeg"]
    assert not data["walk/swept_values"].any()
    assert data["walk/swept"].tolist() == ["", ""]
