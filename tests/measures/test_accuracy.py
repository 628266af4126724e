"""Errors of one step on published and on made-up rows, and roll-outs, which go on like the runtime."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.measures import accuracy_run as module
from hobble.measures.accuracy_run import RollOutInputs, joint_errors, joints_to_measure, measure_accuracy
from hobble.measures.sample import LoadedPart
from hobble.measures.walks import in_root_coordinates
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.rows.clip_rows import pair_batches
from hobble.rows.layout import RowLayout
from hobble.runtime.animation import ProceduralAnimation
from tests.measures.made_up import LAYOUT, made_up_inputs, random_rows, roll_out


@pytest.mark.shared
def test_the_released_network_on_the_original_rows(shared):
    network = load_network(shared / "reference" / "pfnn_release_network.npz")
    with np.load(shared / "reference" / "original_rows_LocomotionFlat09_000.npz") as file:
        x, y, p, released = (file[name] for name in ("X", "Y", "P", "Y_release"))
    # The exact prediction at the phases that the mode constant stores is that of this mode.
    predicted = module.at_stored_phases(network, module.predict_function(network))(x, p.astype(float))
    np.testing.assert_allclose(predicted, released, atol=1e-3)
    errors = joint_errors(RowLayout(31), y, predicted, range(31))
    assert round(float(errors[..., 0].mean()), 4) == 0.0438
    assert 2.3 < errors[..., 1].mean() < 2.7
    smooth = joint_errors(RowLayout(31), y, network.predict(x, p), range(31))
    assert round(float(smooth[..., 0].mean()), 4) == 0.0436, "each row's own phase, not that of its bin"


def test_an_error_of_a_tenth_in_one_joint_gives_the_documented_error():
    layout = RowLayout(2)
    truth, predicted = np.zeros((2, 1, layout.y_size))
    truth[0, layout.y_joint_position] = [0, 90, 0, 3, 0, 4]
    predicted[0, layout.y_joint_position] = [0, 81, 0, 3, 0, 4.5]
    np.testing.assert_allclose(joint_errors(layout, truth, predicted, [0, 1])[0], [[0.1, 9.0], [0.1, 0.5]])
    np.testing.assert_allclose(joint_errors(layout, truth, predicted, [1])[0], [[0.1, 0.5]])
    assert np.isfinite(joint_errors(layout, 0 * truth, predicted, [0, 1])).all(), "at the root"


def test_the_errors_of_a_clip_cover_all_its_pairs(tmp_path):
    rows = random_rows("a", 37, 10, 5)
    inputs = made_up_inputs(tmp_path, {"a": rows})
    network, errors = load_network(inputs.weights), []
    for pairs in pair_batches(rows, rows.layout):
        errors.append(
            joint_errors(LAYOUT, pairs.y, network.predict(pairs.x, pairs.p), range(3)).reshape(-1, 2)
        )
    relative, distance = np.concatenate(errors).T
    (got,) = measure_accuracy(inputs)["clips"]
    expected = {"mean": relative.mean(), "sd": relative.std(), "position_error_cm": distance.mean()}
    assert {key: got[key] for key in expected} == pytest.approx(expected, rel=1e-4)
    assert got["frames"] == 37


def test_results_of_splits_are_means_of_their_clips_and_reproducible(tmp_path: Path, monkeypatch) -> None:
    sizes = {"b": (90, 1), "a": (60, 10), "c": (40, 1), "none": (0, 1)}  # frames, fits
    clips = {name: random_rows(name, *size, i) for i, (name, size) in enumerate(sizes.items())}
    inputs = made_up_inputs(tmp_path, clips, held_out=("c", "none"))
    result = measure_accuracy(inputs, lengths=(1, 30))
    assert [entry["length"] for entry in result["rollouts"]] == [1, 30]
    for entry in (result, *result["rollouts"]):
        a, b, c, none = entry["clips"]
        assert [clip["clip"] for clip in entry["clips"]] == ["a", "b", "c", "none"]
        for key in ("mean", "position_error_cm"):  # every frame counts the same, whatever its fits
            both = (a["frames"] * a[key] + b["frames"] * b[key]) / (a["frames"] + b["frames"])
            assert entry["train"][key] == pytest.approx(both)
            assert entry["held_out"][key] == c[key]
        assert none["mean"] is None
    assert [entry["clips"][2]["ended"] for entry in result["rollouts"]] == [38, 1]
    assert none["last_cm"] is None
    # Nearly the same in the mode constant, and with n - 1.
    a, b, *_ = result["clips"]
    means = [entry["as_published"]["mean"] for entry in (a, b)]
    assert means == pytest.approx([a["mean"], b["mean"]], rel=0.05)
    assert means != [a["mean"], b["mean"]]
    published = {"mean_of_clips": np.mean(means), "sd_of_clips": np.std(means, ddof=1)}
    assert result["train"]["as_published"] == pytest.approx(published)
    assert result["held_out"]["as_published"]["sd_of_clips"] is None
    rows = module.roll_out_rows(result["rollouts"])
    assert (len(rows), rows[0]["clip"]) == (2 * (2 + 4), None)
    json.dumps(result, allow_nan=False)
    # The same bits, however many poses and clips go at once.
    for name, value in (("BATCH", 7), ("AT_ONCE", 1)):
        monkeypatch.setattr(module, name, value)
        assert measure_accuracy(inputs, lengths=(1, 30))["rollouts"] == result["rollouts"]


def test_only_the_first_positions_of_a_clip_count_as_published(tmp_path, monkeypatch) -> None:
    """Of three joints, 30 positions are those of ten frames; a frame counts with all its fits."""
    rows = random_rows("a", 40, 10, 0)
    monkeypatch.setattr(module, "PUBLISHED_POSITIONS", 32)
    inputs = made_up_inputs(tmp_path, {"a": rows, "first": rows.part(slice(10))})
    clip, first = measure_accuracy(inputs)["clips"]
    assert (clip["frames"], clip["as_published"]["frames"]) == (40, 10)
    assert clip["as_published"] == first["as_published"]


def test_equivalent_joints_leave_out_joints_of_larger_skeletons(tmp_path):
    inputs = made_up_inputs(tmp_path, {"a": random_rows("a", 20, 1, 0)})
    network, maps = load_network(inputs.weights), {"maps": {"holden31": {"Foot": "LeftFoot", "Hips": "Hips"}}}
    assert joints_to_measure(network, maps, "equivalent") == [0, 2]
    for skeleton, joints in (({"joints": {}}, "equivalent"), (maps, "all")):
        assert joints_to_measure(network, skeleton, joints) == [0, 1, 2]
    each = [measure_accuracy(inputs, [joint])["train"]["mean"] for joint in (0, 2)]
    both = measure_accuracy(inputs, [0, 2])
    assert (both["joints"], both["train"]["mean"]) == (2, pytest.approx(np.mean(each)))


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
    step = np.diff(roots, axis=0, append=roots[-1:])[:, None]
    velocity = in_root_coordinates(step, np.zeros((frames, 3)), yaws)[:, 0, ::2]
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


def test_short_roll_outs_start_twice_and_long_ones_four_times_within_their_length(hurtable: Network) -> None:
    assert hurtable.skeleton is not None
    rows = random_rows("a", 240, 1, 1, hurtable.layout, hurtable.skeleton.to_dict(), 1.0)
    rows.frame[90:] += 20  # a new stretch begins there
    stretches, found = module.stretches_of(LoadedPart(rows, 0, 240), hurtable.layout), {}
    for length in (1, 10, 20, 100, 200):
        sums = module.roll_out_sums(hurtable.predictor(), stretches, range(31), length)
        found[length] = module.values_of_roll_outs(sums.sum(axis=0))
    # Of 90 and 150 frames in a row the first of each starts none.
    for length, step in ((1, 1), (10, 5), (20, 10), (100, 25)):
        starts = [(n, s) for n in (90, 150) for s in range(1, n, step)]
        assert found[length]["frames"] == sum(min(length, n - s) for n, s in starts)
        assert found[length]["ended"] == sum(s + length < n for n, s in starts)
    assert (found[200]["ended"], found[200]["last_cm"]) == (0, None)
