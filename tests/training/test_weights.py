"""weights.npz: the network, the meaning of its columns, and the ranges of its training data."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hobble.database.reader import Database
from hobble.models.network import TrainingFacts
from hobble.rows.layout import GAITS


@pytest.fixture
def data(small_database: Path) -> Database:
    return Database.open(small_database, 64)


@pytest.mark.parametrize("memory", [64, 0])
def test_the_ranges_cover_every_row_with_every_fit(small_database: Path, memory: int) -> None:
    data = Database.open(small_database, memory)
    s = data.statistics
    seen = TrainingFacts.from_rows(data.layout, data.each_row("train"), s)
    (block,) = data.blocks("train", 0, 0, 1, 0, data.sample_count("train"))
    x, y = block.x * s.x_std + s.x_mean, block.y * s.y_std + s.y_mean
    for name, values in (("x", x), ("y", y)):
        np.testing.assert_array_equal(getattr(seen, f"{name}_low"), values.min(axis=0))
        np.testing.assert_array_equal(getattr(seen, f"{name}_high"), values.max(axis=0))
    same = np.flatnonzero((x == seen.start_x).all(axis=1))  # the row to start from, with one of its grounds
    assert len(same)
    assert block.p[same[0]] == np.float32(seen.start_phase)
    columns = np.r_[data.layout.x_position, data.layout.x_direction]
    columns = np.r_[columns, data.layout.x_joint_position, data.layout.x_joint_velocity]
    far = np.square(block.x[:, columns]).mean(axis=1)
    assert (far < far[same[0]] - 1e-6).mean() < 0.01  # of many grounds, another may be nearer to the mean


def test_if_no_row_stands_a_character_starts_from_the_stillest(small_database: Path) -> None:
    """The gait "stand" can be common in the mean without a row that stands for certain."""
    data = Database.open(small_database, 64)
    stand = data.layout.x_gait.start + GAITS.index("stand") * data.layout.samples + data.layout.samples // 2
    mean, std = data.statistics.x_mean.copy(), data.statistics.x_std.copy()
    mean[stand], std[stand] = 0.3, 0.0  # each row stands to 30 %
    s = replace(data.statistics, x_mean=mean, x_std=std)
    seen = TrainingFacts.from_rows(data.layout, data.each_row("train"), s)
    (block,) = data.blocks("train", 0, 0, 1, 0, data.sample_count("train"))
    x, y = block.x * s.x_std + s.x_mean, block.y * s.y_std + s.y_mean
    moved = np.square(x[:, data.layout.x_position]).sum(axis=1)
    moved += np.square(y[:, data.layout.y_joint_velocity]).sum(axis=1)
    start = np.square(seen.start_x[data.layout.x_position]).sum()
    start += np.square(seen.start_y[data.layout.y_joint_velocity]).sum()
    assert start == pytest.approx(moved.min(), rel=1e-3)
