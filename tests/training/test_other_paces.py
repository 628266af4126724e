"""Motion that is played at other paces along smooth paths."""

from typing import Any

import numpy as np
import torch

from hobble.database.reader import Database
from hobble.training.augment import RISE, OtherPaces

from .conftest import change

CPU = torch.device("cpu")
ROWS, SPEED, SLOPE, FACTOR = 400, 1.5, 0.2, 1.5  # SPEED: cm a frame, SLOPE: cm of height a sample


def walkers(data: Database) -> tuple[Any, Any]:
    """X and Y in raw units of figures that walk straight on at SPEED on level ground, in float64."""
    layout = data.layout
    x, y = torch.zeros(ROWS, layout.x_size).double(), torch.zeros(ROWS, layout.y_size).double()
    frames = torch.tensor(list(layout.offsets)).double()
    n = layout.samples
    x[:, layout.x_position][:, n:] = SPEED * frames
    x[:, layout.x_direction][:, n:] = 1.0
    y[:, layout.y_position][:, layout.future :] = SPEED * frames[layout.future :]
    y[:, layout.y_direction][:, layout.future :] = 1.0
    y[:, layout.y_root_velocity.stop - 1] = SPEED
    y[:, layout.y_phase_change] = 0.02
    for block in (layout.x_joint_velocity, layout.y_joint_velocity):
        (x if block is layout.x_joint_velocity else y)[:, block] = 3.0
    x[:, layout.x_channel("injury")] = 7.0
    return x, y


def played(data: Database, x: Any, y: Any, factor: float = FACTOR) -> tuple[Any, Any]:
    """Raw X and Y after the first batch."""
    s = data.statistics
    std, mean = (
        torch.from_numpy(np.concatenate(pair)).double() for pair in ((s.x_std, s.y_std), (s.x_mean, s.y_mean))
    )
    both = (torch.cat([x, y], dim=1) - mean) / std
    inputs, outputs = (part.float().contiguous() for part in both.split([x.shape[1], y.shape[1]], dim=1))
    change(OtherPaces(data, factor, range(len(x)), CPU), inputs, y=outputs)
    both = torch.cat([inputs, outputs], dim=1).double() * std + mean
    return both.split([x.shape[1], y.shape[1]], dim=1)


def paces(data: Database, y: Any) -> Any:
    return y[:, data.layout.y_root_velocity.stop - 1] / SPEED


def test_a_straight_walk_stays_one_at_paces_spread_evenly(data: Database) -> None:
    layout, n = data.layout, data.layout.samples
    x, y = played(data, *walkers(data))
    pace = paces(data, y)
    even = np.sort(np.log(pace.numpy()) / np.log(FACTOR))
    np.testing.assert_allclose(even, np.linspace(-1, 1, ROWS), atol=0.03)
    path = x[:, layout.x_position]
    assert path[:, :n].abs().max() < 1e-3
    # The end of the window says how the pace changes; everything between follows.
    time = torch.tensor(list(layout.offsets)).double() / layout.window
    ahead = path[:, n:] / (SPEED * layout.window)
    rise = 1 - ahead[:, 0] / -pace
    np.testing.assert_allclose(ahead, pace[:, None] * time * (1 + rise[:, None] * time), atol=1e-3)
    np.testing.assert_allclose(np.sort(rise), np.linspace(-RISE / 2, RISE / 2, ROWS), atol=0.01)
    assert abs(np.corrcoef(rise, pace)[0, 1]) < 0.1
    np.testing.assert_allclose(
        y[:, layout.y_position][:, layout.future :], path[:, n + layout.future :], atol=0.01
    )
    np.testing.assert_allclose(x[:, layout.x_direction][:, n:], 1.0, atol=1e-3)
    np.testing.assert_allclose(y[:, layout.y_phase_change][:, 0], 0.02 * pace, atol=1e-4)
    for table, block in ((x, layout.x_joint_velocity), (y, layout.y_joint_velocity)):
        np.testing.assert_allclose(
            table[:, block], (3.0 * pace)[:, None].expand(-1, 3 * layout.joints), atol=1e-3
        )
    np.testing.assert_allclose(x[:, layout.x_channel("injury")], 7.0, atol=1e-5)


def test_the_pose_before_is_nearer_at_a_slower_pace(data: Database) -> None:
    layout = data.layout
    x, y = walkers(data)
    x[:, layout.x_joint_position], y[:, layout.y_joint_position] = 10.0, 14.0
    x, y = played(data, x, y)
    expected = 14.0 - 4.0 * paces(data, y)
    found = x[:, layout.x_joint_position]
    np.testing.assert_allclose(found, expected[:, None].expand_as(found), atol=0.01)
    np.testing.assert_allclose(y[:, layout.y_joint_position], 14.0, atol=0.01)


def test_joints_keep_their_heights_above_a_slope(data: Database) -> None:
    layout, n = data.layout, data.layout.samples
    x, y = walkers(data)
    slope = SLOPE * (torch.arange(n).double() - (n - 1) / 2)
    x[:, layout.x_terrain] = slope.repeat(3)
    x[:, layout.x_joint_position], y[:, layout.y_joint_position] = 10.0, 10.0
    x, y = played(data, x, y)
    ground = x[:, layout.x_terrain][:, n : 2 * n]
    np.testing.assert_allclose(ground.mean(dim=1), 0.0, atol=1e-4)
    here = ground[:, n // 2]
    for table, block in ((x, layout.x_joint_position), (y, layout.y_joint_position)):
        joints = table[:, block].unflatten(1, (-1, 3))
        above = joints[..., 1] - here[:, None]
        np.testing.assert_allclose(above, 10.0 - float(slope[n // 2]), atol=0.01)
        np.testing.assert_allclose(joints[..., ::2], 10.0, atol=0.01)
    steep = (ground[:, n // 2 + 1] - here) / SLOPE
    assert steep.min() < 0.75, "a slower walker sees the same slope closer"
    assert steep.max() > 1.4


def test_sway_shrinks_by_shares_spread_evenly_and_a_curve_stays(data: Database) -> None:
    layout, n = data.layout, data.layout.samples
    x, y = walkers(data)
    time = torch.tensor(list(layout.offsets)).double() / layout.window
    sway = torch.tensor([1.0, -1.0]).double().repeat(n // 2) * (time != 0)
    powers = torch.stack([time, time**2], dim=1)
    sway = sway - powers @ (torch.linalg.pinv(powers) @ sway)
    x[:, layout.x_position][:, :n] = 30 * time**2 + 4 * sway
    x, _ = played(data, x, y, 1 + 1e-9)
    # Where the pace hardly changes, only the smoothing is left.
    rise = 1 + x[:, layout.x_position][:, n] / (SPEED * layout.window)
    rest = (x[:, layout.x_position][:, :n] - 30 * time**2) @ sway / (4 * sway @ sway)
    rest = rest[rise.abs() < 0.02]
    assert len(rest) > 20
    np.testing.assert_allclose(np.sort(rest), np.linspace(0, 1, len(rest)), atol=0.15)
