"""Roll-outs in training: the poses have the errors that a running character would have."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import torch

from hobble.database.reader import Database
from hobble.measures.rollouts_run import RollOutInputs
from hobble.training.augment import RollOut
from tests.measures.whole_roll_outs import roll_out

from .conftest import change

CPU = torch.device("cpu")
FRAMES, STARTS = 5, 9


class Mixer:
    """A predictor whose Y is a fixed mixture of X."""

    def __init__(self, data: Database) -> None:
        self.network = SimpleNamespace(layout=data.layout, memory_size=0)
        shape = (data.layout.x_size, data.layout.y_size)
        self.mixture = np.random.default_rng(1).normal(0, 0.02, shape)
        self.mixture[:, data.layout.y_phase_change] = 0

    def predict(self, x: Any, phase: Any) -> Any:
        return x @ self.mixture


def straight(data: Database) -> RollOutInputs:
    """A clip whose joints move exactly by their velocities, with a root that stands on level ground."""
    layout, rng, rows = data.layout, np.random.default_rng(2), STARTS + FRAMES
    x, y = rng.normal(0, 5, (rows, layout.x_size)), rng.normal(0, 5, (rows, layout.y_size))
    for row in range(rows):
        if row:
            x[row, layout.x_joint_position] = y[row - 1, layout.y_joint_position]
            x[row, layout.x_joint_velocity] = y[row - 1, layout.y_joint_velocity]
        carried = x[row, layout.x_joint_position] + y[row, layout.y_joint_velocity]
        y[row, layout.y_joint_position] = carried
    still = np.zeros(rows)
    return RollOutInputs(x, y, still, still, still, np.zeros((rows, 2)), still)


def test_poses_carry_the_same_errors_as_a_roll_out(data: Database) -> None:
    """On consecutive rows, the result equals that of the evaluation's roll-out of the same clip."""
    layout, s = data.layout, data.statistics
    given, predictor = straight(data), Mixer(data)
    starts = np.arange(STARTS)
    made, _ = roll_out(predictor, given, starts, FRAMES)  # type: ignore[arg-type]
    carried = RollOut(data, 2 * STARTS, range(STARTS), CPU)
    carried.begin_section()
    whole = slice(FRAMES, None)  # places whose roll-out does not end meanwhile
    pose = slice(layout.x_joint_position.start, layout.x_joint_velocity.stop)
    for age in range(FRAMES):
        at = starts + age
        added = torch.zeros(STARTS, layout.x_size)
        change(carried, added)
        off = added.numpy() * s.x_std
        if age:
            truth = given.y[at - 1][:, layout.y_joint_position]
            expected = (made[age - 1].reshape(STARTS, -1) - truth)[whole]
            assert off[whole, layout.x_joint_position] == pytest.approx(expected, rel=1e-3, abs=1e-3)
            assert np.abs(expected).max() > 1
        off[:, pose] = 0
        assert np.all(off == 0)
        error = predictor.predict(given.x[at] + added.numpy() * s.x_std, None) - given.y[at]
        carried.after(torch.from_numpy(error / s.y_std).float())


def test_each_place_restarts_after_its_frames(data: Database) -> None:
    """A fifth of the places restarts at every batch."""
    frames, rows = 5, 10
    carried = RollOut(data, frames, range(rows), CPU)
    carried.begin_section()
    zero = []
    for _ in range(3 * frames):
        x = torch.zeros(rows, data.layout.x_size)
        change(carried, x)
        zero.append((torch.count_nonzero(x, dim=1) == 0).numpy())
        carried.after(torch.ones(rows, data.layout.y_size))
    assert zero[0].all()
    counts = np.sum(zero[frames:], axis=1)
    assert set(counts) == {rows // frames}
    assert set(np.sum(zero[frames : 2 * frames], axis=0)) == {1}
