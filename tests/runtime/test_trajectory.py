"""The trajectory: targets bend it, predictions move it, and left is the mirror of right."""

import numpy as np
import pytest

from hobble.rows.layout import RowLayout
from hobble.runtime import controller, trajectory

LAYOUT = RowLayout(31)
LENGTH, MIDDLE = 2 * LAYOUT.window, LAYOUT.window


def path(
    speed: float = 1.5, yaw: float = 0.0, stand: float = 0.0
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position (1, T, 2), direction and gait of a straight glide that is now at the origin."""
    ahead = np.array([np.sin(yaw), np.cos(yaw)])
    t = np.arange(LENGTH) - MIDDLE
    position = (t[:, None] * speed * ahead)[None]
    gait = np.zeros((1, LENGTH, 6))
    gait[..., 0], gait[..., 1] = stand, 1 - stand
    return position, np.tile(ahead, (1, LENGTH, 1)), gait


def prediction(
    speed: float = 1.5, side: float = 0.0, turn: float = 0.0, phase_change: float = 0.02
) -> np.ndarray:
    """Y (1, outputs) of a steady glide with a turn; the future samples lie on the arc."""
    y = np.zeros((1, LAYOUT.y_size), np.float32)
    y[0, LAYOUT.y_root_velocity] = side, speed
    y[0, LAYOUT.y_turn], y[0, LAYOUT.y_phase_change] = turn, phase_change
    t = LAYOUT.step * np.arange(LAYOUT.future)
    y[0, LAYOUT.y_position] = np.concatenate([side * t, speed * t])
    y[0, LAYOUT.y_direction] = np.concatenate([np.sin(-turn * t), np.cos(turn * t)])
    return y


def move(
    y: np.ndarray, position, direction, gait, phase=None, target=(0.0, 1.0), loss: float = 0.0,
    recorded_poses=False, pull: float = 0.0,
) -> np.ndarray:  # fmt: skip
    phase = np.zeros(1) if phase is None else phase
    columns = controller.advance_columns(LAYOUT)
    targets = np.array([target], float)
    controller.advance(y, columns, targets, loss, recorded_poses, pull, (position, direction, gait), phase)
    return phase


@pytest.mark.parametrize(("stand", "moves"), [(0.0, 1.0), (1.0, 0.0)])
def test_a_negative_turn_is_one_to_the_left_and_a_standing_figure_does_not_drift(stand, moves) -> None:
    """q[i+1] q[i]^-1 of a figure that turns left by a has yaw -a, because it is that of the world."""
    position, direction, gait = path(stand=stand)
    phase = move(prediction(speed=2.0, turn=-0.05), position, direction, gait)
    np.testing.assert_allclose(position[0, MIDDLE], [0, 2.0 * moves], atol=1e-6)
    np.testing.assert_allclose(direction[0, MIDDLE], [np.sin(0.05 * moves), np.cos(0.05 * moves)], atol=1e-6)
    assert phase[0] == pytest.approx((0.1 + 0.9 * moves) * 0.02)


AGAINST, RECORDED = {"loss": 0.25}, {"recorded_poses": True, "pull": 0.2}


@pytest.mark.parametrize(
    ("side", "target", "moved", "options"),
    [
        # Movement against the target is reduced, here by a quarter.
        (0.5, (0.0, 0.0), (0.375, 1.5), AGAINST),  # the target is to stand
        (0.5, (0.0, -3.0), (0.5, 1.2), AGAINST),  # against the target, with a push, but not across it
        # Recorded poses move nearer to the target: half of the share along it, all of it across.
        (0.0, (0.0, 2.1), (0.0, 2.1), RECORDED),  # reached with less than the whole share
        (0.0, (3.0, 4.0), (0.12 + 0.32, 2.0 + 0.16 - 0.24), RECORDED),  # faster, and more to the left
    ],
)
def test_movement_is_brought_nearer_to_the_target(side: float, target, moved, options) -> None:
    position, direction, gait = path(stand=0.5 if options is RECORDED else 0.0)
    move(prediction(speed=2.0, side=side), position, direction, gait, target=target, **options)
    np.testing.assert_allclose(position[0, MIDDLE], moved, atol=1e-6)


@pytest.mark.parametrize(("strafe", "position_bias", "direction_bias"), [(0.0, 0.5, 2.0), (1.0, 1.0, 0.5)])
def test_strafing_follows_from_velocity_and_facing(
    strafe: float, position_bias: float, direction_bias: float
) -> None:
    position, direction, gait = path(1.0)
    velocity, target = np.array([[3.0, 1.0]]), np.array([[1.0, 0.0]])
    smoothed = velocity, target, np.array([strafe]), np.zeros((1, 2)), np.zeros((1, 2))
    trajectory.blend_future(smoothed, (position, direction, gait))
    t = np.arange(1, MIDDLE) / MIDDLE
    share = 1 - (1 - t) ** position_bias
    np.testing.assert_allclose(np.diff(position[0, MIDDLE:], axis=0)[:, 0], 3.0 * share, atol=1e-9)
    np.testing.assert_allclose(np.diff(position[0, MIDDLE:], axis=0)[:, 1], 1.0, atol=1e-9)
    yaw = np.arctan2(direction[0, MIDDLE + 1 :, 0], direction[0, MIDDLE + 1 :, 1])
    np.testing.assert_allclose(yaw, np.pi / 2 * (1 - (1 - t) ** direction_bias), atol=1e-9)


def follow(target, facing, steering: float, frames: int = 1, speed: float = 1.5, correction=None):
    """Smoothed velocity (2,) and direction (2,), and the correction (2,), of a figure that glides ahead
    whatever the target.
    """
    position, heading, gait = path(speed)
    velocity, direction = np.zeros((1, 2)), np.array([[0.0, 1.0]])
    correction = np.zeros((1, 2)) if correction is None else np.array([correction], float)
    earlier = np.array([target], float)
    for _ in range(frames):
        wanted = np.array([target]), np.array([facing]), np.zeros(1), np.eye(6)[[1]]
        smoothed = velocity, direction, np.zeros(1), correction, earlier
        trajectory.follow_target(wanted, steering, smoothed, (position, heading, gait))
    return velocity[0], direction[0], correction[0]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("degrees", "beyond"), [(0, 0), (20, 20), (60, 60), (100, 37), (140, 0), (179, 0)])
def test_steering_turns_further_than_the_remaining_angle(degrees: float, beyond: float, sign: int) -> None:
    facing = np.radians(sign * degrees)
    target = 1.5 * np.array([np.sin(facing), np.cos(facing)])
    for speed, extra in ((1.5, beyond), (0.0, 0)):
        _, direction, _ = follow(target * speed / 1.5, (np.sin(facing), np.cos(facing)), 2.0)
        yaw = np.degrees(np.arctan2(*direction))
        assert yaw == pytest.approx(0.9 * sign * (degrees + extra), abs=1e-6)


@pytest.mark.parametrize(("speed", "expected"), [(1.5, 0.0), (1.2, 0.3)])
def test_whoever_walks_a_circle_as_asked_is_not_corrected(speed: float, expected: float) -> None:
    """The mean velocity of the past lags behind on a circle, but not because the figure turns too late."""
    position, heading, gait = path(speed)
    ahead = np.array([[0.0, 1.0]])
    smoothed = np.zeros((1, 2)), ahead, np.zeros(1), np.zeros((1, 2)), 1.5 * ahead
    for frame in range(300):
        yaw = 0.008 * (frame - np.arange(MIDDLE)[::-1])
        steps = speed * np.column_stack([np.sin(yaw), np.cos(yaw)])
        position[0, 1 : MIDDLE + 1] = np.cumsum(steps, axis=0)
        wanted = 1.5 * np.array([[np.sin(yaw[-1]), np.cos(yaw[-1])]])
        target = wanted, wanted / 1.5, np.zeros(1), np.eye(6)[[1]]
        trajectory.follow_target(target, 2.0, smoothed, (position, heading, gait))
    faster, left = smoothed[3][0]
    assert (faster > expected) if expected else abs(faster) < 0.05
    assert abs(left) < 0.15  # .7 if measured from the present target
