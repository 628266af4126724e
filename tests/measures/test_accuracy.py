"""Accuracy of the published network on the published rows, and the formula on made-up rows."""

import json
from dataclasses import replace

import numpy as np
import pytest

from hobble.core.errors import HobbleError, InputError
from hobble.measures import accuracy_run as module
from hobble.measures.accuracy_run import at_stored_phases, joint_errors, measure_accuracy, predict_function
from hobble.measures.measure import JointOptions, MeasureInputs
from hobble.models.load import load_network
from hobble.rows.clip_rows import pair_batches
from hobble.rows.layout import RowLayout
from tests.measures.made_up import LAYOUT, made_up_inputs, random_rows


@pytest.mark.shared
def test_the_released_network_on_the_original_rows(shared):
    network = load_network(shared / "reference" / "pfnn_release_network.npz")
    with np.load(shared / "reference" / "original_rows_LocomotionFlat09_000.npz") as file:
        x, y, p, released = (file[name] for name in ("X", "Y", "P", "Y_release"))
    # The exact prediction at the phases that the mode constant stores is that of this mode.
    predicted = at_stored_phases(network, predict_function(network))(x, p.astype(float))
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
    assert np.isfinite(joint_errors(layout, np.zeros_like(truth), predicted, [0, 1])).all(), "at the root"


@pytest.mark.parametrize("fits", [1, 10])
def test_the_errors_of_a_clip_cover_all_its_pairs(tmp_path, fits):
    rows = random_rows("a", 37, fits, 5)
    inputs = made_up_inputs(tmp_path, {"a": rows})
    network = load_network(inputs.weights)
    relative, distance = np.concatenate(
        [
            joint_errors(LAYOUT, pairs.y, network.predict(pairs.x, pairs.p), range(3)).reshape(-1, 2)
            for pairs in pair_batches(rows, rows.layout)
        ]
    ).T
    (got,) = measure_accuracy(inputs)["clips"]
    assert got["frames"] == 37
    expected = {"mean": relative.mean(), "sd": relative.std(), "position_error_cm": distance.mean()}
    assert {key: got[key] for key in expected} == pytest.approx(expected, rel=1e-4)
    for name, share in module.QUANTILES.items():
        assert got[name] == pytest.approx(np.quantile(relative, share), rel=0.05)


def test_accuracy_per_clip_and_split(tmp_path):
    sizes = {"b": (20, 1), "a": (40, 10), "c": (30, 1), "none": (0, 1)}  # frames, fits
    clips = {name: random_rows(name, *size, i) for i, (name, size) in enumerate(sizes.items())}
    inputs = made_up_inputs(tmp_path, clips, held_out=("c", "none"))
    result = measure_accuracy(inputs)
    a, b, c, none = result["clips"]
    assert [entry["clip"] for entry in result["clips"]] == ["a", "b", "c", "none"]
    assert result["train"]["frames"] == 60
    for key in ("mean", "position_error_cm"):  # every frame counts the same, whatever its fits
        assert result["train"][key] == pytest.approx((40 * a[key] + 20 * b[key]) / 60)
    assert result["train"]["mean_of_clips"] == pytest.approx((a["mean"] + b["mean"]) / 2)
    same = ("frames", "mean", "sd", "position_error_cm", "p50")
    assert [result["held_out"][key] for key in same] == [c[key] for key in same]
    assert (none["mean"], none["p50"], result["held_out"]["clips"]) == (None, None, 1)
    # Nearly the same in the mode constant, and with n - 1.
    means = [entry["as_published"]["mean"] for entry in (a, b)]
    assert means == pytest.approx([a["mean"], b["mean"]], rel=0.05)
    assert means != [a["mean"], b["mean"]]
    spread = {
        "mean_of_clips": pytest.approx(np.mean(means)),
        "sd_of_clips": pytest.approx(np.std(means, ddof=1)),
    }
    assert result["train"]["as_published"] == spread
    assert result["held_out"]["as_published"]["sd_of_clips"] is None
    json.dumps(result, allow_nan=False)
    assert result == measure_accuracy(inputs)


def test_only_the_first_positions_of_a_clip_count_as_published(tmp_path, monkeypatch) -> None:
    """Of three joints, 30 positions are those of ten frames; a frame counts with all its fits."""
    rows = random_rows("a", 40, 10, 0)
    monkeypatch.setattr(module, "PUBLISHED_POSITIONS", 32)
    inputs = made_up_inputs(tmp_path, {"a": rows, "first": rows.part(slice(10))})
    clip, first = measure_accuracy(inputs)["clips"]
    assert (clip["frames"], clip["as_published"]["frames"]) == (40, 10)
    assert clip["as_published"] == first["as_published"]


def test_equivalent_joints_leave_out_joints_of_larger_skeletons(tmp_path):
    for skeleton, expected in (
        ({"maps": {"holden31": {"Foot": "LeftFoot", "Hips": "Hips"}}}, ["Foot", "Hips"]),
        ({"joints": {}}, None),
    ):
        (tmp_path / "skeleton.yaml").write_text(json.dumps(skeleton))
        inputs = MeasureInputs("x", {"skeleton": tmp_path / "skeleton.yaml"})
        assert module.joints_to_measure(inputs, JointOptions(joints="equivalent")) == expected
        assert module.joints_to_measure(inputs, JointOptions()) is None
    inputs = made_up_inputs(tmp_path, {"a": random_rows("a", 20, 1, 0)})
    each = [measure_accuracy(inputs, [name])["train"]["mean"] for name in ("Foot", "Hips")]
    both = measure_accuracy(inputs, ["Foot", "Hips"])
    assert (both["joints"], both["train"]["mean"]) == (2, pytest.approx(np.mean(each)))
    with pytest.raises(HobbleError, match="Tail"):
        measure_accuracy(inputs, ["Tail"])


def test_rows_of_another_layout_are_refused(tmp_path):
    other = replace(
        random_rows("a", 0, 1, 0),
        layout=RowLayout(4, channels=(("injury", 1),)),
        x=np.zeros((0, 144)),
        y=np.zeros((0, 68)),
    )
    with pytest.raises(InputError, match=r"a\.npz: its rows .* are not those the network has learnt"):
        measure_accuracy(made_up_inputs(tmp_path, {"a": other}))
