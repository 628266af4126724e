"""Local phases of feet and hands, the frames between gait cycles, and what a network makes of both."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from hobble.core.clip import Clip
from hobble.core.skeleton import Skeleton
from hobble.labels import LabelOptions
from hobble.labels.label import label_clip, mirror_labels
from hobble.labels.local_phase import MIRRORED_PARTS, local_phases
from hobble.models.local.predictor import next_phases
from hobble.motion.edit import mirror_clip
from hobble.rows.build_rows import cycle_frames
from tests.engine.networks import network_of

MOTION = {"source_frames": 600, "source_fps": 60.0}


def test_each_foot_has_a_cycle_for_each_of_its_steps(walker: Callable[..., Clip]) -> None:
    """Steps of 50 frames, the left one at .6 of the cycle; after them the person stands."""
    clip = walker(900, half=25, limp=0.6, start=60)
    landings = [np.arange(60 + first, 500, 50) for first in (30, 0)]  # of the left and the right foot
    contacts = np.ones((900, 4))
    for foot, of_foot in enumerate(landings):
        for landing in of_foot:
            contacts[landing - 20 : landing, 2 * foot : 2 * foot + 2] = 0
    vectors, change = local_phases(clip, contacts)
    walking, length = slice(120, 420), np.linalg.norm(vectors, axis=-1)
    np.testing.assert_allclose(change[walking, :2].sum(axis=0), 6, atol=0.1)
    assert change[walking, :2].min() > 0
    angle = np.arctan2(vectors[..., 1], vectors[..., 0]) / (2 * np.pi)
    apart = (angle[walking, 1] - angle[walking, 0]) % 1.0
    np.testing.assert_allclose(apart, 0.6, atol=0.06)
    assert length[walking, :2].min() > 0.3
    assert length[650:850, :2].max() < 0.03, "a foot that stands has no phase"


def test_a_mirrored_clip_has_the_phases_of_the_other_side(walker: Callable[..., Clip]) -> None:
    clip = walker(400, limp=0.4)
    contacts = np.random.default_rng(1).random((400, 4)) > 0.5
    vectors, change = local_phases(clip, contacts)
    mirrored, mirrored_change = local_phases(mirror_clip(clip, "mirrored"), contacts[:, [2, 3, 0, 1]])
    np.testing.assert_allclose(mirrored, vectors[:, list(MIRRORED_PARTS)], atol=1e-6)
    np.testing.assert_allclose(mirrored_change, change[:, list(MIRRORED_PARTS)], atol=1e-6)


@pytest.mark.parametrize("margins", ["extend", "drop"])
def test_the_frames_between_gait_cycles_can_be_used(walker: Callable[..., Clip], margins: str) -> None:
    clip, margin = walker(start=200), 1 if margins == "extend" else 60
    for between in (False, True):
        options = LabelOptions(margins=margins, between=between)
        labels, report = label_clip(clip, [], MOTION, None, "flat", options)
        mirrored, _ = mirror_labels(labels, report, mirror_clip(clip, "mirrored"))
        for cycles in (labels.cycles, mirrored.cycles):
            used = np.unique(cycle_frames(cycles)[0])
            everything = np.arange(margin, len(clip) - margin - 1)
            assert np.array_equal(used, everything) == between
            assert (np.diff(cycles[:, 0]) > 0).all()
            assert (cycles[1:, 0] >= cycles[:-1, 1]).all()


def test_the_network_carries_phases_without_losing_their_length() -> None:
    """The predicted vectors lag behind the predicted change of the angles; their length is right."""
    angle, lag, step = 0.3, 0.04, 0.02
    before = 0.5 * np.array([[np.cos(angle), np.sin(angle), 0.0, 0.0]])
    late = 2 * np.pi * step + angle - lag
    predicted = 0.45 * np.array([[np.cos(late), np.sin(late), 0.0, 0.0]])
    after = next_phases(before, predicted, np.array([[step, 0.1]]))[0]
    np.testing.assert_allclose(np.hypot(after[0], after[1]), 0.45)
    weights = np.array([0.5, 0.45])
    expected = weights @ np.array([late + lag, late]) / weights.sum()
    np.testing.assert_allclose(np.arctan2(after[1], after[0]), expected, atol=1e-4)
    assert not after[2:].any(), "a part that rests stays at rest"


def test_a_character_remembers_the_rotations_that_were_predicted(holden31: Skeleton, tmp_path: Path) -> None:
    """The second frame is that of a network whose X has the rotations of the first, whatever X has."""
    network = network_of("local", holden31, tmp_path)
    layout, predictor = network.layout, network.predictor(storage="float32")
    x = np.random.default_rng(4).normal(0, 3, (2, layout.x_size)).astype(np.float32)
    memory, phase = network.memory_of(x), np.zeros(2)
    first = predictor.predict(x, phase, memory=memory).copy()
    np.testing.assert_allclose(first, network.predict(x, phase), atol=1e-3)
    kept = memory[:, 1:].copy()
    second = predictor.predict(x, phase, memory=memory)
    x[:, layout.x_local_phase] = kept[:, : 2 * layout.local_phases]
    x[:, layout.x_joint_rotation] = first[:, layout.y_joint_rotation]
    np.testing.assert_allclose(second, network.predict(x, phase), atol=1e-3)
    assert np.abs(second - first).max() > 0.1
