"""Motion matching at run time: which frames are shown, when it searches. The page does the same."""

from typing import Any

import numpy as np
import pytest

from hobble.core.skeleton import Skeleton
from hobble.models.matching.network import ROW, SINCE, Matching
from hobble.models.network import STORAGES, standardise_inputs

from .example import FRAMES, built

Made = tuple[Any, dict[str, Any], Matching]


@pytest.fixture(scope="module")
def made(holden31: Skeleton, tmp_path_factory: Any) -> Made:
    return built(holden31, tmp_path_factory.mktemp("matching"), every=5)


@pytest.fixture(scope="module")
def network(made: Made) -> Matching:
    return made[2]


def x_of(network: Matching, row: int) -> np.ndarray:
    """An X (1, X) float32 with the features of a row."""
    x = network.x_mean.copy()
    known = network.feature_weights > 0
    x[network.columns[known]] = network.features[row, known] / network.feature_weights[known]
    return x[None].astype(np.float32)


def test_the_nearest_frame_equals_a_search_over_all(network: Matching) -> None:
    x = network.x_mean + 10 * np.random.default_rng(1).normal(size=(20, len(network.x_mean)))
    queries = network.input_features(standardise_inputs(network, x))
    np.testing.assert_allclose(queries, x[:, network.columns] * network.feature_weights, rtol=1e-4, atol=1e-3)
    apart = np.square(queries[:, None] - network.features[network.start_rows][None]).sum(axis=2)
    np.testing.assert_array_equal(network.nearest_rows(queries), network.start_rows[apart.argmin(axis=1)])


def test_channel_values_have_to_match(network: Matching) -> None:
    """A query equals a frame of the healthy clip except for the channel. It finds a frame of the hurt
    clip.
    """
    x = x_of(network, 10)
    x[0, network.layout.x_channel("injury").start + 4] = 7.0
    assert network.nearest_rows(network.input_features(standardise_inputs(network, x)))[0] >= FRAMES[0]


def test_a_character_plays_on_between_searches(network: Matching) -> None:
    predictor, memory = network.predictor(), np.zeros((1, network.memory_size))
    away = x_of(network, FRAMES[0] + 30)  # what it asks for from the second frame on
    shown = []
    for frame in range(8):
        x = x_of(network, 10) if frame == 0 else away
        y = predictor.predict(x, np.array([network.phase[10 + frame]]), None, memory)
        shown.append(int(memory[0, ROW]) - 1)
        if frame < 5:
            np.testing.assert_allclose(y[0], network.frames[10 + frame], atol=1e-4)
    assert shown == [10, 11, 12, 13, 14, FRAMES[0] + 30, FRAMES[0] + 31, FRAMES[0] + 32]
    assert memory[0, SINCE] == 2


@pytest.mark.parametrize("wrong", [-3.0, 1e7, np.nan, np.inf])
def test_an_invalid_memory_is_reset(network: Matching, wrong: float) -> None:
    memory = np.full((1, network.memory_size), wrong)
    y = network.predictor().predict(x_of(network, 30), np.zeros(1), None, memory)
    np.testing.assert_array_equal(y[0], network.frames[30])
    assert np.isfinite(memory).all()


def test_a_crowd_equals_single_characters(network: Matching) -> None:
    """Each asks for one place of the clips after another."""
    rows = np.repeat(np.random.default_rng(4).choice(network.start_rows, 12), 7)[:80]
    wishes = np.concatenate([x_of(network, row) for row in rows])
    predictor, phase = network.predictor(), np.array([0.1, 0.4, 0.8])
    memory, alone = (np.zeros((3, network.memory_size)) for _ in range(2))
    for frame in range(40):
        x = wishes[[frame, frame - 5, frame - 10]]
        y = predictor.predict(x, phase, None, memory)
        for c in range(3):
            own = predictor.predict(x[c : c + 1], phase[c : c + 1], None, alone[c : c + 1])
            np.testing.assert_array_equal(y[c], own[0])
    exact, near = (network.predictor(storage=name).predict(wishes, np.zeros(80)) for name in STORAGES)
    assert 0 < np.abs(exact - near).max() < 1e-3


def test_a_page_of_many_rows_has_the_first_part_of_each_run(network: Matching) -> None:
    assert len(network.copy_for_page().remaining) == sum(FRAMES)
    short = network.copy_for_page(80)  # of 70 and 90 rows, half
    np.testing.assert_array_equal(short.remaining, [*range(34, -1, -1), *range(44, -1, -1)])
    np.testing.assert_array_equal(short.frames[35:], network.frames[70:115])
    np.testing.assert_array_equal(short.features[:35], network.features[:35])
    assert short.start_rows.max() < 80 - 20
