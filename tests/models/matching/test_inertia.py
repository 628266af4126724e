"""Transitions: no joint jumps, and the offsets decay."""

import numpy as np
import pytest

from hobble.core import quat
from hobble.models.matching.network import ROW, Matching
from hobble.rows.layout import RowLayout

J, HALFLIFE = 3, 6.0
LAYOUT = RowLayout(J)
BLOCKS = LAYOUT.y_joint_position, LAYOUT.y_joint_velocity, LAYOUT.y_joint_rotation


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
        y = np.zeros((60, LAYOUT.y_size), np.float32)
        for block, values in zip(BLOCKS, (position, speed, rotation), strict=True):
            y[:, block] = values
        y[:, LAYOUT.y_phase_change] = 0.02
        out.append(y)
    return np.concatenate(out)


def played(frames: np.ndarray, rows: list[int], phase: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """What is shown if a search finds these rows, one in each frame, and the phase of the character."""
    zeros, shown, lag = np.zeros(LAYOUT.x_size, np.float32), [], []
    remaining = np.tile(np.arange(60)[::-1], 2)
    network = Matching(
        x_mean=zeros, x_std=zeros + 1, y_mean=frames[0] * 0, y_std=frames[0] * 0 + 1, layout=LAYOUT,
        features=zeros[None, :1].repeat(120, axis=0), frames=frames, remaining=remaining,
        phase=(0.02 * np.arange(120) % 1).astype(np.float32), columns=np.array([0]),
        feature_weights=zeros[:1], every=1, halflife=HALFLIFE,
    )  # fmt: skip
    predictor, memory, phases = network.predictor(), np.zeros((1, network.memory_size)), np.array([phase])
    for row in rows:
        predictor._search = lambda *_, row=row: np.array([row])  # type: ignore[method-assign]
        y = predictor.predict(zeros[None], phases, None, memory)
        assert memory[0, ROW] == row + 1
        phases = (phases + y[0, LAYOUT.y_phase_change]) % 1
        shown.append(np.concatenate([y[0, block] for block in BLOCKS]).astype(float))
        lag.append(float(abs((phases[0] - 0.02 * (row + 1) + 0.5) % 1 - 0.5)))
    return np.array(shown), np.array(lag)


def spring(x0: np.ndarray, v0: np.ndarray, frames: int = 30) -> np.ndarray:
    """x = (x0 + (v0 + d x0) t) e^(-d t), with d = 2 ln 2 / halflife, after 1, 2, ... frames."""
    d, t = 2 * np.log(2) / HALFLIFE, np.arange(1, frames + 1)[:, None]
    return (x0 + (v0 + d * x0) * t) * np.exp(-d * t)


def test_an_offset_decays_like_a_critically_damped_spring_into_the_new_run() -> None:
    frames = two_runs(np.random.default_rng(3))
    shown, _ = played(frames, [*range(1, 20), *range(70, 100)])
    position, velocity = (frames[:, block].astype(float) for block in BLOCKS[:2])
    expected = spring(position[20] - position[70], velocity[20] - velocity[70])
    np.testing.assert_allclose(shown[19:, : 3 * J] - position[70:100], expected, atol=2e-4)


def test_rotations_do_so_the_shorter_way_and_with_their_speeds() -> None:
    """Both runs turn about Y. Half angles of 1.4 and -1.4 are .34 apart over half a turn."""
    frames = two_runs(np.random.default_rng(4))
    half = np.r_[1.4 - 0.02 * np.arange(-20, 40), -1.4 + 0.01 * np.arange(-10, 50)]
    frames[:, BLOCKS[2]] = np.outer(half, np.tile([0, 1, 0], J))
    shown, _ = played(frames, [*range(1, 20), *range(70, 100)])
    turns = [quat.exp(table.reshape(-1, J, 3)) for table in (shown[19:, 6 * J :], frames[70:100, BLOCKS[2]])]
    offset = quat.log(quat.mul(turns[0], quat.inv(turns[1])))
    expected = spring(np.full(1, 2.8 - np.pi), np.full(1, -0.02 - 0.01))
    np.testing.assert_allclose(offset[..., 1], np.tile(expected, J), atol=1e-4)


@pytest.mark.parametrize("off", [0.3, -0.3])
def test_the_phase_moves_to_that_of_the_clips(off: float) -> None:
    """By .002 cycles a frame, from the second frame on."""
    lag = played(two_runs(np.random.default_rng(6)), list(range(60)), off % 1.0)[1]
    np.testing.assert_allclose(lag, 0.3 - 0.002 * np.arange(60), atol=1e-4)
