"""The character: what goes into the network, what comes out, and how it follows its targets."""

import copy
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core import quat
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.runtime import ProceduralAnimation
from hobble.runtime.caller_targets import Axes
from hobble.runtime.waypoints import TRACK
from tests.runtime.walking import KNEE, hills, same, same_poses, walk


def test_the_input_row_follows_its_definition(hurtable) -> None:
    """X computed in numpy from the state, column by column."""
    character = ProceduralAnimation(hurtable)
    walk(character, 90, injury={KNEE: 6.0}, terrain=hills)
    seen = {}
    evaluate = character.predictor.evaluate

    def look(*arguments) -> None:
        seen["state"] = copy.deepcopy(character.state)
        evaluate(*arguments)

    character.predictor.evaluate = look
    character.next_pose((0.5, 2.0), (1, 0), "jog", injury={KNEE: 6.0}, terrain=hills)
    state, layout, x = seen["state"], hurtable.layout, character._controller.x[0]
    now = layout.window
    position, direction = state.position[0], state.direction[0]

    def to_root(v: np.ndarray, frame: int) -> np.ndarray:
        q = quat.between(np.array([direction[frame, 0], 0, direction[frame, 1]]), np.array([0, 0, 1.0]))
        return quat.rotate(q, v)

    def level(v: np.ndarray) -> np.ndarray:
        return np.stack([v[:, 0], np.zeros(len(v)), v[:, 1]], axis=1)

    samples = np.array(layout.offsets) + now
    places = to_root(level(position[samples] - position[now]), now)
    np.testing.assert_allclose(x[layout.x_position], np.concatenate([places[:, 0], places[:, 2]]), atol=1e-4)
    facing = to_root(level(direction[samples]), now)
    np.testing.assert_allclose(x[layout.x_direction], np.concatenate([facing[:, 0], facing[:, 2]]), atol=1e-6)
    np.testing.assert_allclose(x[layout.x_gait], state.gait[0, samples].T.ravel(), atol=1e-6)
    left = 25 * np.stack([direction[samples, 1], -direction[samples, 0]], axis=1)
    heights = np.array([hills(*(position[samples] + side * left).T) for side in (1, 0, -1)])
    mean = heights[1].mean()
    np.testing.assert_allclose(x[layout.x_terrain], (heights - mean).ravel(), atol=1e-4)
    before = np.array([position[now - 1, 0], mean, position[now - 1, 1]])
    joints = to_root(state.joint_position[0] - before, now - 1)
    np.testing.assert_allclose(x[layout.x_joint_position], joints.ravel(), atol=1e-4)
    velocities = to_root(state.joint_velocity[0], now - 1)
    np.testing.assert_allclose(x[layout.x_joint_velocity], velocities.ravel(), atol=1e-5)
    assert x[layout.x_channel("injury")][2] == 6.0
    assert x[layout.x_channel("injury")].sum() == 6.0


def test_the_pose_follows_from_the_prediction(network) -> None:
    character = ProceduralAnimation(network, foot_locking=False)
    walk(character, 45, terrain=hills)
    old = character.state.joint_position[0].copy()
    pose = character.next_pose((0.5, 2.0), terrain=hills)
    y, layout = character._controller.y[0].astype(float), network.layout
    turn = quat.yaw(pose.yaw)

    def joints(block: slice) -> np.ndarray:
        return y[block].reshape(-1, 3)

    predicted = quat.rotate(turn, joints(layout.y_joint_position)) + pose.root
    carried = old + quat.rotate(turn, joints(layout.y_joint_velocity))
    np.testing.assert_allclose(character.state.joint_position[0], (predicted + carried) / 2, atol=1e-4)
    rotations = quat.mul(turn, quat.exp(joints(layout.y_joint_rotation)))
    np.testing.assert_allclose(character.state.joint_rotation[0], rotations, atol=1e-6)
    legs, *_ = character._controller._legs
    others = np.setdiff1d(np.arange(layout.joints), [*legs.ravel(), 4, 5, 9, 10])
    np.testing.assert_array_equal(pose.positions[others], character.state.joint_position[0][others])
    assert (pose.positions.shape, pose.rotations.shape) == ((31, 3), (31, 4))


def test_many_characters_equal_single_characters(hurtable) -> None:
    rng, count = np.random.default_rng(3), 5
    velocity, facing = rng.normal(0, 2, (count, 2)), rng.normal(size=(count, 2))
    gaits = ["walk", "jog", "crouch", "walk", "jog"]
    severity = rng.uniform(0, 10, count)
    start = rng.normal(0, 100, (count, 3))
    crowd = ProceduralAnimation(hurtable, characters=count, position=start)
    alone = [ProceduralAnimation(hurtable, position=start[k]) for k in range(count)]
    for _ in range(46):
        many = crowd.next_pose(velocity, facing, gaits, injury={KNEE: severity}, terrain=hills)
        singles = [
            one.next_pose(velocity[k], facing[k], gaits[k], injury={KNEE: severity[k]}, terrain=hills)
            for k, one in enumerate(alone)
        ]
    assert many.positions.shape == (count, 31, 3)
    np.testing.assert_allclose(many.positions, [one.positions for one in singles], atol=0.02)
    np.testing.assert_allclose(many.phase, [one.phase for one in singles], atol=1e-4)
    assert singles[-1].channels["injury"].max() == pytest.approx(min(severity[-1], 46 / 6))


def test_the_gait_follows_from_speed_and_argument(network) -> None:
    character = ProceduralAnimation(network)

    def shares(velocity, gait=None) -> dict[str, float]:
        character.next_pose(velocity, gait=gait)
        target = dict(zip(network.gaits, character._targets._shares[0], strict=True))
        return {name: share for name, share in target.items() if share}

    assert shares((0, 0.05), "jog") == {"stand": 1}
    assert shares((0, 0.05), "crouch") == {"stand": 1, "crouch": 1}
    assert shares((0, 2.5)) == {"walk": 1}
    assert shares((0, 7.0)) == {"jog": 1}
    assert shares((0, 7.0), "crouch") == {"crouch": 1}
    assert shares((0, 2.5), np.array([0, 0.5, 0.5, 0, 0, 0])) == {"walk": 0.5, "jog": 0.5}
    with pytest.raises(KeyError, match="no gait 'swim': there are stand, walk, jog"):
        character.next_pose((0, 1), gait="swim")


def test_severities_change_at_their_rate_and_are_scaled(hurtable) -> None:
    character = ProceduralAnimation(hurtable, rates={"injury": 5.0}, scales={"injury": 2.0})
    index = hurtable.channels["injury"].index(KNEE)
    on = [p.channels["injury"][index] for p in walk(character, 120, injury={KNEE: 10})]
    np.testing.assert_allclose(on[:60], 5.0 / 60 * np.arange(1, 61))
    assert on[-1] == pytest.approx(5.0)
    assert walk(character, 5)[-1].channels["injury"].sum() == pytest.approx(5.0), "it is kept"
    assert walk(character, 120, injury={})[-1].channels["injury"].sum() == 0


def test_the_runtime_imports_no_heavy_package(root: Path) -> None:
    """The runtime imports neither torch nor anything that only the workflow or an export needs."""
    heavy = "{'torch', 'snakemake', 'onnx', 'onnxruntime', 'matplotlib', 'plotly'}"
    code = f"import sys, hobble.runtime.animation; sys.exit({heavy} & set(sys.modules) or 0)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=root)
    assert done.stderr == ""
    assert done.returncode == 0


@pytest.mark.shared
@pytest.mark.parametrize(("rise", "tread"), [(15.0, 40.0), (10.0, 30.0)])
def test_the_released_network_keeps_its_feet_out_of_steps(
    shared: Path, holden31, rise: float, tread: float
) -> None:
    """Eight steps up, a landing, eight down: no heel or toe is more than 1 cm inside a step."""
    network = load_network(shared / "reference" / "pfnn_release_network.npz", holden31)
    character = ProceduralAnimation(network)
    legs, _, soles, *_ = character._controller._legs

    def stairs(x: np.ndarray, z: np.ndarray) -> np.ndarray:
        up, down = (np.clip(np.floor((z - start) / tread) + 1, 0, 8) for start in (300, 600 + 8 * tread))
        return rise * (up - down)

    depths = []
    for _ in range(900):
        pose = character.next_pose((0, 2.2), gait="walk", terrain=stairs)
        feet = pose.positions[legs[:, 2:]].reshape(4, 3)
        depths.append(stairs(feet[:, 0], feet[:, 2]) + np.tile(soles, 2) - feet[:, 1])
    assert pose.root[2] > 600 + 16 * tread
    assert np.mean(np.max(depths, axis=1) > 1) < 0.01


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda c: pickle.loads(pickle.dumps(c))])
def test_a_copied_character_goes_on_bit_for_bit(hurtable: Network, copied: Any) -> None:
    """Also on hills, hurt, on a track of waypoints, and in the mode and axes of the first."""
    options = {"waypoints": TRACK, "axes": Axes("left", "Y"), "scales": {"injury": 2.0}}
    first = ProceduralAnimation(hurtable, mode="linear", storage="int16", **options)
    arguments = {"target_velocity": None, "terrain": hills, "injury": {KNEE: 6.0}}
    walk(first, 70, **arguments)
    second = copied(first)
    for _ in range(60):
        same_poses(first.next_pose(**arguments), second.next_pose(**arguments))
    before = copy.deepcopy(first.state)
    second.reset()  # changes the copy alone
    assert same(first.state, before)
