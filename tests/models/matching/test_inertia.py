"""Transitions: no joint jumps, and the offsets decay."""

from __future__ import annotations

import numpy as np
import pytest

from hobble.core import quat
from hobble.models.matching.network import OFFSETS, OFFSETS_PER_JOINT, ROW, show_rows

J, HALFLIFE = 3, 6.0
MEMORY = OFFSETS + OFFSETS_PER_JOINT * J
AT = np.array([0, 3 * J, 6 * J, 9 * J])  # positions, velocities, rotations, change of phase


def two_runs(rng: np.random.Generator) -> np.ndarray:
    """Two runs of 60 frames in which joints move straight on and turn evenly, differently in each."""
    out = []
    for _ in range(2):
        t = np.arange(60)[:, None]
        speed = rng.normal(size=3 * J)
        position = rng.normal(0, 10, 3 * J) + speed * t
        axis = rng.normal(size=(J, 3))
        turn = quat.mul(
            quat.exp(0.01 * axis[None] * t[:, :, None]), quat.exp(rng.normal(0, 0.5, (J, 3)))[None]
        )
        rotation = quat.log(turn).reshape(60, -1)
        out.append(
            np.hstack([position, np.broadcast_to(speed, position.shape), rotation, np.full((60, 1), 0.02)])
        )
    return np.concatenate(out).astype(np.float32)


def played(frames: np.ndarray, rows: list[int]) -> np.ndarray:
    """What is shown if these rows are played, one in each frame."""
    memory, shown = np.zeros((1, MEMORY)), []
    phases = (0.02 * np.arange(len(frames)) % 1).astype(np.float32)
    before = -1
    for row in rows:
        out = np.zeros((1, frames.shape[1]), np.float32)
        following, due = before + 1 if before >= 0 else -1, row != before + 1
        choice = tuple(np.array([value]) for value in (before, following, due, row))
        table = (frames, np.ones(frames.shape[1], np.float32), phases)
        show_rows(memory, table, choice, phases[row : row + 1].astype(float), (J, AT, HALFLIFE), out)
        shown.append(out[0].astype(float))
        before = row
        assert memory[0, ROW] == row + 1
    return np.array(shown)


def test_without_a_transition_the_frames_are_played_unchanged() -> None:
    frames = two_runs(np.random.default_rng(1))
    np.testing.assert_allclose(played(frames, list(range(5, 50))), frames[5:50], atol=1e-6)


def test_a_transition_is_continuous_and_ends_in_the_new_run() -> None:
    frames = two_runs(np.random.default_rng(2))
    shown = played(frames, [*range(1, 20), *range(70, 115)])
    position, velocity = shown[:, : 3 * J], shown[:, 3 * J : 6 * J]
    apart = np.abs(frames[20, : 3 * J] - frames[70, : 3 * J]).max()
    # Without inertialisation the step would be that distance. The spring starts with the old velocity.
    np.testing.assert_allclose(position[19] - position[18], velocity[18], atol=0.12 * apart)
    np.testing.assert_allclose(shown[-1], frames[114], atol=0.02)


def test_an_offset_decays_like_a_critically_damped_spring() -> None:
    """x = (x0 + (v0 + d x0) t) e^(-d t), with d = 2 ln 2 / halflife."""
    frames = two_runs(np.random.default_rng(3))
    shown = played(frames, [*range(1, 20), *range(70, 100)])
    x0 = frames[20, : 3 * J].astype(float) - frames[70, : 3 * J]
    v0 = frames[20, 3 * J : 6 * J].astype(float) - frames[70, 3 * J : 6 * J]
    d = 2 * np.log(2) / HALFLIFE
    t = np.arange(1, 31)[:, None]
    expected = (x0 + (v0 + d * x0) * t) * np.exp(-d * t)
    np.testing.assert_allclose(shown[19:, : 3 * J] - frames[70:100, : 3 * J], expected, atol=2e-4)


def test_rotations_go_the_shorter_way_and_keep_turning() -> None:
    frames = two_runs(np.random.default_rng(4))
    shown = played(frames, [*range(1, 20), *range(70, 115)])
    turns = quat.exp(shown[:, 6 * J : 9 * J].reshape(len(shown), J, 3))
    angles = quat.angle(turns[1:], turns[:-1])
    apart = quat.angle(
        quat.exp(frames[20, 6 * J : 9 * J].reshape(J, 3)), quat.exp(frames[70, 6 * J : 9 * J].reshape(J, 3))
    )
    assert (angles[18] < 0.25 * apart).all(), "no jump"
    np.testing.assert_allclose(
        quat.angle(turns[-1], quat.exp(frames[114, 6 * J : 9 * J].reshape(J, 3))), 0, atol=1e-3
    )


def test_offsets_of_overlapping_transitions_add_up() -> None:
    frames = two_runs(np.random.default_rng(5))
    there_and_back = played(frames, [*range(1, 20), 70, *range(21, 30)])
    assert np.abs(there_and_back[20:24, : 3 * J] - frames[21:25, : 3 * J]).max() > 0.01
    memory = np.zeros((1, MEMORY))
    assert memory.shape[1] == OFFSETS + OFFSETS_PER_JOINT * J


@pytest.mark.parametrize("off", [0.3, -0.3])
def test_the_phase_moves_to_that_of_the_clips(off: float) -> None:
    frames = two_runs(np.random.default_rng(6))
    memory, phases = np.zeros((1, MEMORY)), (0.02 * np.arange(120) % 1).astype(np.float32)
    phase = np.array([off % 1.0])
    for row in range(60):
        out = np.zeros((1, frames.shape[1]), np.float32)
        choice = tuple(np.array([value]) for value in (row - 1, row if row else -1, False, row))
        table = (frames, np.ones(frames.shape[1], np.float32), phases)
        show_rows(memory, table, choice, phase, (J, AT, HALFLIFE), out)
        phase = (phase + out[0, AT[3]]) % 1
    away = abs((phase[0] - 60 * 0.02 + 0.5) % 1 - 0.5)
    assert away == pytest.approx(0.3 - 59 * 0.002, abs=1e-4)
