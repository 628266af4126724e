"""Generated motion: the scripted scenarios, loops of the gaits, and the BVH and glTF files that have them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.core import quat
from hobble.core.skeleton import forward_kinematics
from hobble.motion.read import decode_channels, read_bvh
from hobble.runtime import Runtime, generated
from hobble.runtime.generated import export_bvh, restore_bone_lengths
from hobble.runtime.leg import leg_joints
from tests.figure.glb import Glb


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
    world, reached = restore_bone_lengths(holden31, moved, rotations)
    off = np.linalg.norm(reached[:, legs[:, 3]] - moved[:, legs[:, 3]], axis=-1)
    assert np.median(off) < 1e-6  # all but legs that are stretched further than they are long
    others = np.setdiff1d(np.arange(31), legs[:, :2])  # feet, too
    np.testing.assert_allclose(quat.angle(world[:, others], rotations[:, others]), 0, atol=1e-6)


def test_bvh_round_trip(tmp_path: Path, holden31) -> None:
    positions, rotations = motion(holden31)
    export_bvh(tmp_path / "walk.bvh", "walk", holden31, positions, rotations)
    back, _ = decode_channels(read_bvh(tmp_path / "walk.bvh"))
    columns = [back.skeleton.joints.index(name) for name in holden31.joints]
    np.testing.assert_allclose(back.positions[:, columns], positions, atol=2e-3)


def test_a_walk_is_cut_where_it_repeats() -> None:
    time = np.arange(generated.SETTLED + 60 + generated.LENGTHS[1] + generated.BLEND)
    swing = np.stack([0 * time, 90 + np.sin(2 * np.pi * time / 67), 2.0 * time], axis=1)
    leg = swing + np.stack([0 * time, -50 + 0 * time, 20 * np.sin(2 * np.pi * time / 67)], axis=1)
    first, last, gap = generated.find_cut(np.stack([swing, leg], axis=1))
    assert (last - first) % 67 == 0
    assert gap < 1e-6


def test_scenarios_and_loops_are_written(tmp_path: Path, hurtable, monkeypatch: pytest.MonkeyPatch) -> None:
    """As npz and BVH, and in a glTF file with a loop of each gait, healthy and hurt."""
    monkeypatch.setattr(generated, "SETTLED", 40)
    full = generated.scenarios(hurtable)
    short = [replace(scenario, frames=20) for scenario in full]
    monkeypatch.setattr(generated, "scenarios", lambda _: short)
    generated.generate_scenarios(hurtable, tmp_path / "scenarios.npz", tmp_path / "bvh", Runtime())
    data = np.load(tmp_path / "scenarios.npz")
    names = [str(name) for name in data["names"]]
    assert {"left_knee", "right_knee", "left_ankle", "lower_back", "left_arm"} < set(names)
    assert sorted(p.stem for p in (tmp_path / "bvh").iterdir()) == sorted(names)
    for name in names:
        assert data[f"{name}/positions"].shape == (20, 31, 3)
    knee = data["left_knee/swept_values"]
    assert (knee[0], knee[-1]) == (0, 10)
    assert data["left_knee/swept"].tolist() == ["injury", "LeftUpLeg-LeftLeg"]
    generated.export_glb(tmp_path / "a.glb", hurtable, Runtime())
    file = Glb(tmp_path / "a.glb")
    for gait in generated.SPEEDS:
        for hurt in ("", "_left_knee", "_lower_back"):
            still, moving = f"{gait}{hurt}_loop", f"{gait}{hurt}_loop_root_motion"
            assert not file.keys(still, "root", "translation").any()
            assert file.keys(moving, "root", "translation")[:, 0] == pytest.approx(0, abs=1e-4)
            for animation in (still, moving):  # the last pose is the first one
                for node, path in (("Hips", "translation"), ("LeftLeg", "rotation"), ("Spine1", "rotation")):
                    found = file.keys(animation, node, path)
                    assert found[-1] == pytest.approx(found[0], abs=1e-4)
