"""Roll-outs give the same frames as the runtime, cover every frame, and report the right errors."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.measures.rollouts_run import RollOutInputs, inputs_of_clip, measure_roll_outs, roll_out_rows
from hobble.measures.walks import in_root_coordinates
from hobble.models.network import Network
from hobble.rows.clip_rows import ClipRows
from hobble.rows.layout import RowLayout, channel_inputs
from hobble.runtime.animation import ProceduralAnimation
from tests.measures.made_up import made_up_inputs, random_rows
from tests.measures.whole_roll_outs import clip_roll_outs, roll_out


def hills(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    return 8 * np.sin(x / 70) + 6 * np.cos(z / 50)


def recorded(network: Network, frames: int, ground: Any) -> tuple[RollOutInputs, np.ndarray]:
    """The inputs of a running character in each frame, and its joints (F, J, 3) in the root frame."""
    figure = ProceduralAnimation(network, foot_locking=False)
    figure.next_pose((0.0, 2.0))
    layout, controller, state = network.layout, figure._controller, figure.state
    rows = []
    for f in range(frames):
        phase, speed = float(state.phase[0]), 0.0 if 25 <= f < 45 else 2.5
        target = (speed * np.sin(f / 40), speed * np.cos(f / 40))
        figure.next_pose(target, injury={"LeftUpLeg-LeftLeg": 4}, terrain=ground)
        root, yaw = controller.root[0].copy(), float(controller.yaw[0])
        local = in_root_coordinates(state.joint_position[0], root, np.array(yaw))
        rows.append((controller.x[0].copy(), controller.y[0].copy(), phase, root, yaw, local))
    x, y, phases, roots, yaws, locals_ = (np.array(values) for values in zip(*rows, strict=True))
    step = np.diff(roots[:, ::2], axis=0, append=roots[-1:, ::2])
    sin, cos = np.sin(yaws), np.cos(yaws)
    velocity = np.stack([step[:, 0] * cos - step[:, 1] * sin, step[:, 0] * sin + step[:, 1] * cos], axis=1)
    moving = np.maximum(0, 1 - x[:, layout.x_gait][:, layout.samples // 2]) ** 0.25
    turn = -np.diff(yaws, append=yaws[-1])
    return RollOutInputs(x, y, roots[:, 1], phases, turn, velocity, moving), locals_


@pytest.mark.parametrize("ground", [None, hills])
def test_a_roll_out_equals_the_motion_of_the_runtime(hurtable: Network, ground: Any) -> None:
    """With the runtime's inputs, joints and phase equal those of the runtime."""
    scale = hurtable.x_std.copy()  # one that feels its own velocities and its phase
    scale[hurtable.layout.x_joint_velocity] = 1.0
    hurtable = replace(hurtable, x_std=scale, y_std=np.full_like(hurtable.y_std, 0.2))
    inputs, local = recorded(hurtable, 80, ground)
    starts = np.array([1, 2, 17, 40, 79])
    made, phase = roll_out(hurtable.predictor(), inputs, starts, 60)
    assert [len(place) for place in made] == [5] + [4] * 39 + [3] * 20
    for age, place in enumerate(made):
        np.testing.assert_allclose(place, local[starts[: len(place)] + age], atol=1e-3)
    np.testing.assert_allclose(phase[:2], inputs.phase[starts[:2] + 60], atol=1e-4)
    # The pose is its own: a start from another pose stays another for a while.
    other = RollOutInputs(inputs.x.copy(), *list(vars(inputs).values())[1:])
    other.x[1, hurtable.layout.x_joint_position] += 5
    moved, _ = roll_out(hurtable.predictor(), other, starts[:1], 2)
    assert np.abs(moved[0] - local[1]).max() > 1


LAYOUT = RowLayout(31, channels=(("injury", 30),))


def clip_rows(network: Network, rows: int, seed: int, gap: int | None = None) -> ClipRows:
    """Random rows; with a `gap`, a new stretch begins there."""
    assert network.skeleton is not None
    found = random_rows("a", rows, 1, seed, LAYOUT, network.skeleton.to_dict(), 1.0)
    found.frame[gap if gap is not None else rows :] += 20
    return found


def test_short_roll_outs_start_twice_and_long_ones_four_times_within_their_length(hurtable: Network) -> None:
    rows = clip_rows(hurtable, 240, 1, gap=90)
    found = clip_roll_outs(hurtable.predictor(), rows, range(31), (1, 10, 20, 100, 200))
    # Of 90 and 150 frames in a row the first of each starts none.
    assert found[1]["frames"] == 89 + 149
    assert found[10]["frames"] == sum(min(10, n - s) for n in (90, 150) for s in range(1, n, 5))
    assert found[20]["frames"] == sum(min(20, n - s) for n in (90, 150) for s in range(1, n, 10))
    assert found[20]["ended"] == sum(s + 20 < n for n in (90, 150) for s in range(1, n, 10))
    assert found[100]["frames"] == sum(min(100, n - s) for n in (90, 150) for s in range(1, n, 25))
    assert found[200]["ended"] == 0
    assert found[200]["last_cm"] is None


def test_after_one_frame_a_pose_is_the_mean_of_prediction_and_extrapolation(hurtable: Network) -> None:
    rows = clip_rows(hurtable, 40, 2)
    inputs = inputs_of_clip(rows, np.arange(40), rows.layout)
    layout = hurtable.layout
    read = channel_inputs("injury", rows.channels["injury"])
    np.testing.assert_array_equal(inputs.x[:, layout.x_channel("injury")], read)
    y = hurtable.predictor().predict(inputs.x, inputs.phase)
    made, _ = roll_out(hurtable.predictor(), inputs, np.arange(1, 40), 1)
    before = inputs.x[1:, layout.x_joint_position].reshape(39, 31, 3).astype(float)
    a = inputs.turn[:-1, None]
    x, z = before[..., 0] - inputs.velocity[:-1, :1], before[..., 2] - inputs.velocity[:-1, 1:]
    carried = np.stack(
        [x * np.cos(a) + z * np.sin(a), before[..., 1], z * np.cos(a) - x * np.sin(a)], axis=-1
    )
    speed = y[1:, layout.y_joint_velocity].reshape(39, 31, 3)
    guess = y[1:, layout.y_joint_position].reshape(39, 31, 3)
    np.testing.assert_allclose(made[0], (carried + speed + guess) / 2, atol=1e-4)
    truth = inputs.y[1:, layout.y_joint_position].reshape(39, 31, 3)
    found = clip_roll_outs(hurtable.predictor(), rows, range(31), (1,))[1]
    assert found["position_error_cm"] == pytest.approx(
        np.linalg.norm(truth - made[0], axis=-1).mean(), rel=1e-5
    )


def test_results_of_splits_are_means_of_their_clips_and_reproducible(tmp_path: Path, monkeypatch) -> None:
    sizes = {"a": 60, "b": 90, "c": 40, "none": 0}
    clips = {name: random_rows(name, count, 1, i) for i, (name, count) in enumerate(sizes.items())}
    inputs = made_up_inputs(tmp_path, clips, held_out=("c", "none"))
    result = measure_roll_outs(inputs, lengths=(1, 30))
    assert [entry["length"] for entry in result["lengths"]] == [1, 30]
    for entry in result["lengths"]:
        a, b, c, none = entry["clips"]
        for key in ("mean", "position_error_cm"):
            both = (a["frames"] * a[key] + b["frames"] * b[key]) / (a["frames"] + b["frames"])
            assert entry["train"][key] == pytest.approx(both)
            assert entry["held_out"][key] == c[key]
        assert none["mean"] is None
        assert c["ended"] == {1: 38, 30: 1}[entry["length"]]
    rows = roll_out_rows(result)
    assert (len(rows), rows[0]["clip"]) == (2 * (2 + 4), None)
    json.dumps(result, allow_nan=False)
    # The same bits, however many poses and clips go at once.
    for name, value in (("BATCH", 7), ("AT_ONCE", 1)):
        monkeypatch.setattr(f"hobble.measures.rollouts_run.{name}", value)
        assert measure_roll_outs(inputs, lengths=(1, 30)) == result
