"""The weight of the phase in the loss, and channels whose inputs are divided."""

from pathlib import Path

import numpy as np
import pytest
import torch

from hobble.core.errors import InputError
from hobble.database.reader import Database
from hobble.training.batches import HeldOutErrors

CPU = torch.device("cpu")


def block(data: Database) -> tuple[np.ndarray, np.ndarray]:
    made = next(data.blocks("train", 0, 0, 1, 1, block_rows=10_000))
    return made.x, made.y


def test_only_the_error_of_the_phase_gets_the_weight(data: Database) -> None:
    (x, y), (weighted_x, weighted_y) = block(data), block(Database.open(data.path, 64, 8.0))
    at = data.layout.y_phase_change.start
    assert np.array_equal(weighted_x, x)
    np.testing.assert_allclose(weighted_y[:, at], 8 * y[:, at], rtol=1e-4, atol=1e-5)
    assert np.array_equal(np.delete(weighted_y, at, axis=1), np.delete(y, at, axis=1))
    one, other = data.statistics, Database.open(data.path, 64, 8.0).statistics
    raw, weighted = y * one.y_std + one.y_mean, weighted_y * other.y_std + other.y_mean
    np.testing.assert_allclose(weighted, raw, rtol=1e-4, atol=1e-5)


def test_only_the_inputs_of_a_divided_channel_are_smaller(data: Database, small_database: Path) -> None:
    """Raw values stay the same, so a network of the divided rows takes the same severities as any other."""
    whole, divided = data, Database.open(small_database, 64, scales={"injury": 5.0})
    (x, y), (divided_x, divided_y) = block(whole), block(divided)
    columns = data.layout.x_channel("injury")
    assert np.abs(x[:, columns]).max() > 0
    np.testing.assert_allclose(5 * divided_x[:, columns], x[:, columns], rtol=2e-3, atol=1e-6)
    assert np.array_equal(np.delete(divided_x, columns, axis=1), np.delete(x, columns, axis=1))
    assert np.array_equal(divided_y, y)
    raw = [block(d)[0] * d.statistics.x_std + d.statistics.x_mean for d in (whole, divided)]
    np.testing.assert_allclose(*raw, rtol=2e-3, atol=1e-3)
    with pytest.raises(InputError, match="the channel mood is not in this database"):
        Database.open(small_database, 64, scales={"mood": 2.0})


class Means:
    """Predicts the mean of every output."""

    def __init__(self, data: Database) -> None:
        self.outputs = data.layout.y_size

    def __call__(self, x: torch.Tensor, p: torch.Tensor) -> torch.Tensor:
        return torch.zeros(len(x), self.outputs)


def test_held_out_errors_do_not_depend_on_the_weight(data: Database) -> None:
    errors = HeldOutErrors(data, CPU, 0).errors_on_every_row(Means(data))
    assert HeldOutErrors(Database.open(data.path, 64, 8.0), CPU, 0).errors_on_every_row(
        Means(data)
    ) == pytest.approx(errors, rel=1e-4)
