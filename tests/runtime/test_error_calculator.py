"""The error calculator: truth, prediction and error of recorded rows, frame by frame."""

import numpy as np
import pytest

from hobble.core import quat
from hobble.measures.accuracy_run import joint_errors
from hobble.rows.clip_rows import ClipRows, compose_pairs, headings, root_path
from hobble.runtime.animation import ProceduralAnimation
from hobble.runtime.caller_targets import Axes


@pytest.fixture
def rows(network) -> ClipRows:
    """120 frames of a figure that glides in a circle over rising ground, with noise."""
    layout, count, rng = network.layout, 120, np.random.default_rng(4)
    y = np.tile(network.y_mean, (count, 1)) + rng.normal(0, 0.5, (count, layout.y_size)).astype(np.float32)
    y[:, layout.y_turn], y[:, layout.y_root_velocity] = -2 * np.pi / count, (0, 2.0)
    mean, ones = np.linspace(0, 20, count).astype(np.float32), np.ones(count, np.int32)
    y[:, layout.y_joint_position.start + 1 : layout.y_joint_position.stop : 3] += mean[:, None]
    x, heights, phase = (
        rng.normal(0, size, (count, columns)).astype(np.float32)
        for size, columns in ((20, layout.x_terrain.start), (3, 3 * layout.samples), (1, 1))
    )
    frame, p = np.arange(60, 60 + count, dtype=np.int32), phase[:, 0] % 1
    return ClipRows("a", layout, {}, x, y, p, {}, frame, 0 * ones, ones, heights, mean)


def test_truth_prediction_and_error_of_every_frame(network, rows: ClipRows) -> None:
    unreal = Axes("left", "Z", "m")
    found, theirs = (ProceduralAnimation(network, axes=axes).compare(rows) for axes in (Axes(), unreal))
    x, y, z = np.moveaxis(found.predicted.positions, -1, 0)
    np.testing.assert_allclose(theirs.predicted.positions, np.stack([z, -x, y], axis=-1) / 100, atol=1e-9)
    layout = network.layout
    every = np.arange(len(rows))
    pairs = compose_pairs(rows, layout, every, every)
    predicted = network.predict(pairs.x, pairs.p)
    errors = joint_errors(layout, pairs.y, predicted, range(31))
    root = root_path(rows.y[:, layout.y_root_velocity].astype(float), rows.y[:, layout.y_turn][:, 0])
    yaw = headings(rows.y[:, layout.y_turn][:, 0].astype(float))
    for k, frame in enumerate(found):
        assert frame.frame == rows.frame[k]
        np.testing.assert_allclose(frame.distance, errors[k, :, 1], atol=1e-3)
        np.testing.assert_allclose(frame.relative, errors[k, :, 0], atol=1e-4)
        # The captured pose stands at the captured root, at the height that the clip has.
        local = rows.y[k, layout.y_joint_position].reshape(-1, 3).astype(float)
        np.testing.assert_allclose(
            frame.truth.positions, quat.rotate(quat.yaw(yaw[k]), local) + root[k], atol=1e-3
        )
        apart = np.linalg.norm(frame.truth.positions - frame.predicted.positions, axis=-1)
        np.testing.assert_allclose(apart, frame.distance, atol=1e-4)
    assert k == len(found) - 1 == len(rows) - 1
    # A negative turn of the world is one to the left: the figure goes in a circle to +X.
    assert root[:, 0].mean() == pytest.approx(120 * 2 / (2 * np.pi), rel=0.02)
