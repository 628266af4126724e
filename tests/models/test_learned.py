"""Learned motion matching: it learns the clips, goes on by itself, and jumps smoothly."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.models.learned import train
from hobble.models.learned.network import SINCE, Learned
from hobble.models.matching.network import Matching

from .matching.example import built

Made = tuple[Matching, Learned]


@pytest.fixture(scope="module")
def made(holden31: Skeleton, tmp_path_factory: Any) -> Made:
    """Motion matching over two clips, and a network that learnt them in a short training."""
    folder = tmp_path_factory.mktemp("learned")
    sizes = {"steps": 300, "units": 64, "decompressor_units": 128, "latent": 8}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(train, "STRETCH", 5)
        patch.setattr(train, "POOL", 2048)
        return built(holden31, folder)[2], built(holden31, folder, "learned", **sizes)[2]


def x_of(network: Matching, rows: np.ndarray) -> np.ndarray:
    """Inputs (n, X) with the features of rows."""
    x = np.repeat(network.x_mean[None], len(rows), axis=0)
    known = network.feature_weights > 0
    x[:, network.columns[known]] = network.features[rows][:, known] / network.feature_weights[known]
    return x.astype(np.float32)


def test_it_shows_nearly_the_frames_that_a_search_finds(made: Made) -> None:
    matching, learned = made
    rows = matching.start_rows
    block = learned.layout.y_joint_position
    shown = learned.predict(x_of(matching, rows), np.zeros(len(rows)))[:, block]
    truth = matching.frames[rows][:, block]
    error, spread = np.abs(shown - truth).mean(), np.abs(truth - truth.mean(axis=0)).mean()
    assert error < 0.25 * spread


def test_between_searches_it_plays_the_clip(made: Made) -> None:
    matching, learned = made
    predictor, memory = learned.predictor(), np.zeros((1, learned.memory_size))
    block, row = learned.layout.y_joint_position, int(matching.start_rows[3])
    spread = np.abs(matching.frames[:, block] - matching.frames[:, block].mean(axis=0)).mean()
    for frame in range(4):
        y = predictor.predict(x_of(matching, np.array([row])), np.zeros(1), None, memory)
        assert memory[0, SINCE] == frame
        assert np.abs(y[0, block] - matching.frames[row + frame, block]).mean() < 0.3 * spread


def test_no_joint_jumps_when_the_wish_changes(made: Made) -> None:
    """The made-up velocities do not fit the positions, so they are set to 0."""
    matching, learned = made
    (*weights, last), (*biases, bias) = (tuple(map(np.copy, arrays)) for arrays in learned.decompressor)
    last[:, learned.layout.y_joint_velocity], bias[:, learned.layout.y_joint_velocity] = 0, 0
    learned = replace(learned, decompressor=((*weights, last), (*biases, bias)))
    predictor, memory = learned.predictor(), np.zeros((1, learned.memory_size))
    block, wishes = learned.layout.y_joint_position, x_of(matching, np.array([5, 130]))
    poses = [predictor.predict(wishes[[t // 20]], np.zeros(1), None, memory)[0, block] for t in range(40)]
    move = np.abs(np.diff(poses, axis=0)).max(axis=1)
    jump = np.abs(np.diff(learned.predict(wishes, np.zeros(2))[:, block], axis=0)).max()
    assert move[19:].max() < 0.5 * jump, (move, jump)


def test_the_same_seed_gives_the_same_bits(holden31: Skeleton, tmp_path: Path) -> None:
    tiny = {"steps": 2, "units": 8, "decompressor_units": 8, "latent": 3}
    one, again, other = (built(holden31, tmp_path, "learned", seed=n, **tiny)[0].arrays for n in (1, 1, 2))
    assert all(np.array_equal(one[name], again[name]) for name in one)
    assert not np.array_equal(one["D0"], other["D0"])
