"""Bounds: wild predictions do not break the character, nor does ground that is switched."""

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


def run(network: Pfnn, frames: int = 600) -> tuple[np.ndarray, np.ndarray]:
    """Heights of the hips and the largest movement of a joint in each frame, before foot placement.

    Every half second the targets change at random.
    """
    character, rng = ProceduralAnimation(network, foot_locking=False), np.random.default_rng(4)
    kept = []
    for frame in range(frames):
        if frame % 30 == 0:
            velocity, facing = rng.uniform(-8, 8, 2) * rng.integers(2), rng.normal(size=2)
        character.next_pose(velocity, facing, "jog")
        kept.append(character.state.joint_position[0].copy())
    positions = np.array(kept)
    hips = positions[:, network.skeleton.role("hips"), 1]
    return hips, np.linalg.norm(np.diff(positions, axis=0), axis=-1).max(axis=1)


def test_wild_predictions_do_not_break_the_character(make_network) -> None:
    wild = replace(make_network(scale=60.0), y_std=np.ones_like(make_network().y_std))
    hips, moved = run(replace(wild, training_facts=walked(wild)))
    standing = wild.y_mean[wild.layout.y_joint_position][1]
    assert 0.5 * standing < hips.min() <= hips.max() < 1.2 * standing
    assert moved.max() <= SPEED_MARGIN * 4.0 + 1e-3
    free_hips, free_moved = run(wild)
    assert free_moved.max() > 20, "without bounds it should fall apart"
    assert np.ptp(free_hips) > np.ptp(hips)


@pytest.mark.parametrize("value", [np.nan, 1e30])
def test_a_prediction_that_is_not_finite_does_no_harm(network, value: float) -> None:
    """One joint of one character is predicted so in a single frame."""
    character = ProceduralAnimation(network, characters=2)
    evaluate, column = character.predictor.evaluate, network.layout.y_joint_position.start

    def broken(z, phase, y, memory) -> None:
        evaluate(z, phase, y, memory)
        y[1, column] = value

    for frame in range(40):
        character.predictor.evaluate = broken if frame == 20 else evaluate
        pose = character.next_pose((0, 2.0))
        assert np.isfinite(pose.positions).all()
    assert np.abs(pose.positions[1] - pose.positions[0]).max() < 5


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
    least = 0.75 * network.skeleton.leg_length if with_facts else 0.67 * mean
    assert least - 1e-3 <= min(heights) <= max(heights) <= 1.175 * mean + 1e-3
