"""Bounds: wild predictions do not break the character, and a state that is not finite restarts."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from hobble.models.network import TrainingFacts
from hobble.models.pfnn import Pfnn
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.bounds import SPEED_MARGIN


def walked(network: Pfnn, fastest: float = 4.0) -> TrainingFacts:
    """The ranges of training data in which figures move at 1 to 2 cm a frame and never stand."""
    layout = network.layout
    x = np.zeros(layout.x_size, np.float32)
    x[layout.x_direction][layout.samples :] = 1
    ahead = np.array(layout.offsets, np.float32)
    x[layout.x_position][layout.samples :] = 1.5 * ahead
    x[layout.x_gait].reshape(-1, layout.samples)[1] = 1
    y = network.y_mean.copy()
    x[layout.x_joint_position] = y[layout.y_joint_position]
    x_wide, y_wide = np.full_like(x, 0.05), np.full_like(y, 0.05)
    x_wide[layout.x_position], y_wide[layout.y_position] = 30, 30
    x_wide[layout.x_joint_position], y_wide[layout.y_joint_position] = 8, 8
    return TrainingFacts(
        x - x_wide, x + x_wide, y - y_wide, y + y_wide, x, y, start_phase=0.3, fastest=fastest
    )


def targets(frames: int):
    rng = np.random.default_rng(4)
    for k in range(frames):
        if k % 30 == 0:
            target = rng.uniform(-8, 8, 2) * rng.integers(2), rng.normal(size=2)
        yield target


def run(network: Pfnn, frames: int = 600) -> tuple[np.ndarray, np.ndarray]:
    """Heights of the hips and the largest movement of a joint in each frame, before foot placement."""
    character = ProceduralAnimation(network, foot_locking=False)
    role = network.skeleton.role
    kept = []
    for velocity, facing in targets(frames):
        character.next_pose(velocity, facing, "jog")
        kept.append(character.state.joint_position[0].copy())
    positions = np.array(kept)
    return positions[:, role("hips"), 1], np.linalg.norm(np.diff(positions, axis=0), axis=-1).max(axis=1)


def test_wild_predictions_do_not_break_the_character(make_network) -> None:
    wild = replace(make_network(scale=60.0), y_std=np.ones_like(make_network().y_std))
    hips, moved = run(replace(wild, training_facts=walked(wild)))
    standing = wild.y_mean[wild.layout.y_joint_position][1]
    assert 0.5 * standing < hips.min() <= hips.max() < 1.2 * standing
    assert moved.max() <= SPEED_MARGIN * 4.0 + 1e-3
    free_hips, free_moved = run(wild)
    assert free_moved.max() > 20, "without bounds it should fall apart"
    assert np.ptp(free_hips) > np.ptp(hips)


def test_a_character_starts_in_the_start_frame(make_network) -> None:
    network = make_network(scale=0.0)
    seen = walked(network)
    character = ProceduralAnimation(
        replace(network, training_facts=seen), position=(100.0, 0, 50.0), facing=(1.0, 0, 0)
    )
    state, middle = character.state, network.layout.window
    assert state.phase[0] == 0.3
    np.testing.assert_allclose(state.position[0, middle], [100, 50], atol=1e-4)
    np.testing.assert_allclose(state.position[0, middle - 20], [70, 50], atol=1e-4)  # it came from there
    np.testing.assert_allclose(state.direction[0], np.tile([1.0, 0], (2 * middle, 1)), atol=1e-6)
    assert state.gait[0, :, 1].min() == 1.0
    x, y, z = network.y_mean[network.layout.y_joint_position].reshape(-1, 3).T
    np.testing.assert_allclose(state.joint_position[0], np.stack([z + 100, y, 50 - x], axis=1), atol=1e-4)


@pytest.mark.parametrize("with_facts", [False, True])
def test_the_hips_keep_their_height_when_the_ground_is_switched(make_network, with_facts: bool) -> None:
    """The ground under a walking character jumps up and down by a metre, or becomes a slope."""
    network = make_network(scale=0.2)
    if with_facts:  # in training the hips were as low as in a crouch, once
        facts, column = walked(network), network.layout.y_joint_position.start + 1
        low = facts.y_low.copy()
        low[column] = 0.3 * network.y_mean[column]
        network = replace(network, training_facts=replace(facts, y_low=low))
    character, hips, heights = ProceduralAnimation(network), network.skeleton.role("hips"), []
    grounds = [lambda x, z, g=g: g[0] + g[1] * z for g in ((0, 0), (100, 0), (-100, 0), (0, 0.4), (30, 0))]
    for frame in range(300):
        ground = grounds[frame // 30 % len(grounds)]
        x, y, z = character.next_pose((0, 2.5), terrain=ground).positions[hips]
        heights.append(y - ground(x, z))
    mean = network.y_mean[network.layout.y_joint_position].reshape(-1, 3)[hips, 1]
    assert 0.67 * mean - 1e-3 <= min(heights) <= max(heights) <= 1.175 * mean + 1e-3


@pytest.mark.parametrize(
    "part", ["position", "joint_position", "phase", "channel_values", "foot_lift", "joint_rotation"]
)
@pytest.mark.parametrize("value", [np.nan, 1e30])
def test_a_state_that_is_not_finite_restarts_and_warns_once(hurtable, part: str, value: float) -> None:
    character = ProceduralAnimation(hurtable, characters=2)
    for _ in range(30):
        healthy = character.next_pose((0, 2.0), injury={hurtable.channels["injury"][0]: 4.0})
    getattr(character.state, part)[1] = value
    with pytest.warns(RuntimeWarning, match="was not finite or too large for 1 characters") as warned:
        poses = [character.next_pose((0, 2.0), terrain=lambda x, z: 0.1 * z) for _ in range(30)]
    assert len(warned) == 1
    assert all(np.isfinite(p.positions).all() and np.isfinite(p.rotations).all() for p in poses)
    assert np.abs(poses[0].root[1] - healthy.root[1]).max() < 30, "it stays where it was"
    np.testing.assert_allclose(poses[-1].channels["injury"][1][0], 4.0)
    getattr(character.state, part)[0] = value
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isfinite(character.next_pose((0, 2.0)).positions).all()
