"""Input poses that are moved towards those of clips with other channel values."""

from typing import Any

import numpy as np
import pytest
import torch

from hobble.database.reader import Database
from hobble.training.augment import BEYOND, NEAR, OtherPoses

from .conftest import change

CPU = torch.device("cpu")
ROWS = 200


def batch(
    data: Database, pose: float, phase: float, jog: float = 0.0, rows: int = ROWS, hurt: float | None = None
) -> Any:
    """Rows with one value in every column of the pose, a share of a jog, and a value of the channel."""
    layout = data.layout
    x = torch.full((rows, layout.x_size), 7.0)
    for block in (layout.x_joint_position, layout.x_joint_velocity):
        x[:, block] = pose
    jogs = layout.x_gait.start + 2 * layout.samples
    x[:, jogs : jogs + layout.samples] = jog / float(data.statistics.x_std[jogs])
    x[:, layout.x_channel("injury")] = pose if hurt is None else hurt
    return x, torch.full((rows,), phase)


def of_pose(data: Database) -> list[int]:
    layout = data.layout
    blocks = (layout.x_joint_position, layout.x_joint_velocity)
    return [column for block in blocks for column in range(block.start, block.stop)]


def test_a_share_of_the_rows_moves_evenly_towards_the_pose_before(data: Database) -> None:
    others, columns = OtherPoses(data, 0.4, range(ROWS), CPU), of_pose(data)
    others.begin_section()
    first, p = batch(data, 0.0, 0.51)
    change(others, first, p)
    assert torch.equal(first, batch(data, 0.0, 0.51)[0]), "no place has another pose yet"
    x, p = batch(data, 1.0, 0.52)
    change(others, x, p)
    part = 1 - x[:, columns[0]].numpy()
    assert torch.equal(x[:, columns], x[:, columns[:1]].expand(-1, len(columns)))
    rest = [column for column in range(data.layout.x_size) if column not in columns]
    assert torch.equal(x[:, rest], batch(data, 1.0, 0.52)[0][:, rest])
    assert np.mean(part == 0) == pytest.approx(0.6, abs=0.02)
    moved = np.sort(part[part != 0])
    np.testing.assert_allclose(moved, np.linspace(-BEYOND, 1, len(moved)), atol=0.03)
    again, p = batch(data, 2.0, 0.52)
    change(others, again, p)
    assert again[:, columns].min() == pytest.approx(1.0, abs=0.05), (
        "towards the row's own pose, not the moved"
    )
    assert not torch.equal(again[:, columns[0]] < 2, x[:, columns[0]] < 1), "other rows in each batch"


@pytest.mark.parametrize(
    ("phase", "jog", "hurt"), [(0.53 + NEAR, 0.0, 1.0), (0.52, 1.0, 1.0), (0.52, 0.0, 0.0)]
)
def test_no_pose_of_another_phase_or_gait_or_of_the_same_values(
    data: Database, phase: float, jog: float, hurt: float
) -> None:
    others = OtherPoses(data, 1.0, range(ROWS), CPU)
    others.begin_section()
    change(others, *batch(data, 0.0, 0.52))
    x, p = batch(data, 1.0, phase, jog, hurt=hurt)
    change(others, x, p)
    assert torch.equal(x, batch(data, 1.0, phase, jog, hurt=hurt)[0])


def test_the_nearest_phase_is_taken_also_over_the_end_of_the_cycle(data: Database) -> None:
    others = OtherPoses(data, 1.0, range(ROWS), CPU)
    others.begin_section()
    for pose, phase in ((10.0, 0.04), (20.0, 0.99), (30.0, 0.96)):
        change(others, *batch(data, pose, phase))
    x, p = batch(data, 0.0, 0.01)
    change(others, x, p)
    assert float(x[:, of_pose(data)].max()) == pytest.approx(20.0, rel=0.02)
