"""Generated motion as BVH, and the scripted scenarios."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hobble.core import quat
from hobble.core.skeleton import forward_kinematics
from hobble.models.load import load_network
from hobble.runtime import ProceduralAnimation
from hobble.runtime.export import export_bvh, fitted_skeleton, motion_clip
from hobble.runtime.feet import leg_joints
from hobble.runtime.options import Runtime
from hobble.runtime.scenarios import generate_scenarios, scenarios, swept_columns


def motion(skeleton, frames: int = 20) -> tuple[np.ndarray, np.ndarray]:
    """World positions and rotations of a skeleton in random motion."""
    rng = np.random.default_rng(2)
    local = quat.exp(rng.normal(0, 0.3, (frames, len(skeleton.joints), 3)))
    rotations, positions = forward_kinematics(skeleton, local, rng.normal(0, 50, (frames, 3)))
    return positions, rotations


def read_again(path: Path) -> dict[str, np.ndarray]:
    """Joint -> world positions (F, 3) of a BVH file, read without our code."""
    head, table = path.read_text().split("MOTION")
    values = np.array([line.split() for line in table.strip().splitlines()[2:]], float)
    stack: list[tuple[np.ndarray, Rotation]] = []
    out, column, name, offset = {}, 0, "", np.zeros(3)
    for line in head.splitlines():
        words = line.split()
        if words[:1] in (["ROOT"], ["JOINT"], ["End"]):
            name = words[1] if words[0] != "End" else ""
        elif words[:1] == ["OFFSET"]:
            offset = np.array(words[1:], float)
            if not name:
                stack.append((np.zeros(3), Rotation.identity()))
        elif words[:1] == ["CHANNELS"]:
            channels = {c: values[:, column + i] for i, c in enumerate(words[2:])}
            column += len(channels)
            turn = Rotation.identity()
            for channel, angle in channels.items():
                if channel.endswith("rotation"):
                    turn = turn * Rotation.from_euler(channel[0].lower(), angle[:, None], degrees=True)
            own = np.stack(
                [channels.get(f"{axis}position", np.zeros(len(values))) for axis in "XYZ"], axis=-1
            )
            at, world = stack[-1] if stack else (np.zeros(3), Rotation.identity())
            at = at + (world.apply(offset + own) if stack else own)
            stack.append((at, world * turn))
            out[name] = at
        elif words[:1] == ["}"]:
            stack.pop()
    return out


def test_an_exported_clip_has_the_original_motion(holden31) -> None:
    positions, rotations = motion(holden31)
    clip = motion_clip("walk", holden31, positions, rotations)
    np.testing.assert_allclose(clip.positions, positions, atol=1e-9)
    np.testing.assert_allclose(quat.angle(clip.global_rotations, rotations), 0, atol=1e-6)


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
    back = read_again(tmp_path / "walk.bvh")
    assert set(back) == set(holden31.joints)
    for j, name in enumerate(holden31.joints):
        np.testing.assert_allclose(back[name], positions[:, j], atol=2e-3)


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


def test_each_scenario_hurts_its_link(hurtable, network) -> None:
    assert {name: link for name, (_, link) in swept_columns(hurtable).items()} == {
        "left_knee": "LeftUpLeg-LeftLeg",
        "right_knee": "RightUpLeg-RightLeg",
        "left_ankle": "LeftLeg-LeftFoot",
        "lower_back": "Hips-LowerBack",
        "left_arm": "LeftArm-LeftForeArm",
    }
    assert swept_columns(network) == {}
    mean = np.zeros_like(hurtable.x_mean)
    mean[hurtable.layout.x_channel("injury").start + hurtable.channels["injury"].index("LowerBack-Spine")] = (
        0.1
    )
    trained = {name: link for name, (_, link) in swept_columns(replace(hurtable, x_mean=mean)).items()}
    assert trained["lower_back"] == "LowerBack-Spine"
    assert trained["left_knee"] == "LeftUpLeg-LeftLeg"
    assert len(scenarios(hurtable)) == len(scenarios(network)) + 5


@pytest.mark.shared
def test_a_walk_of_the_released_network_is_a_valid_bvh(shared: Path, tmp_path: Path, holden31) -> None:
    """The body of the released network differs from holden31: its bones are found, and joints are within 3
    cm.
    """
    network = load_network(shared / "reference" / "pfnn_release_network.npz", holden31)
    character = ProceduralAnimation(network)
    poses = [character.next_pose((0, 2.5)) for _ in range(200)][50:]
    positions, rotations = np.array([p.positions for p in poses]), np.array([p.rotations for p in poses])
    body = fitted_skeleton(holden31, positions, rotations)
    export_bvh(tmp_path / "walk.bvh", "walk", body, positions, rotations)
    back = read_again(tmp_path / "walk.bvh")
    off = [np.linalg.norm(back[name] - positions[:, j], axis=-1) for j, name in enumerate(holden31.joints)]
    assert np.mean(off) < 3
