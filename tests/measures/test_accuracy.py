"""Accuracy of the published network on the published rows, and the formula on made-up rows."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import HobbleError, InputError
from hobble.core.files import write_csv
from hobble.measures.accuracy_run import (
    QUANTILES,
    at_stored_phases,
    clip_errors,
    clips_table,
    joint_errors,
    joint_indices,
    joints_to_measure,
    measure_accuracy,
    predict_function,
)
from hobble.measures.measure import JointOptions, MeasureInputs
from hobble.models.load import NEEDED_ROLES, load_network
from hobble.rows.clip_rows import ClipRows, pair_batches, save_clip_rows
from hobble.rows.layout import RowLayout
from tests.measures.made_up import random_rows

LAYOUT = RowLayout(3, channels=(("injury", 1),))
SKELETON = {
    "name": "stick",
    "joints": {
        n: {"parent": p, "offset": [0, 1, 0]} for n, p in (("Hips", None), ("Arm", "Hips"), ("Foot", "Hips"))
    },
    "roles": dict.fromkeys(NEEDED_ROLES, "Foot") | {"hips": "Hips"},
    "links": [["Hips", "Arm"]],
}


def make_rows(clip: str, rows: int, fits: int, seed: int) -> ClipRows:
    return random_rows(clip, LAYOUT, SKELETON, rows, fits, seed, spread=5.0)


def make_network(
    layers: int = 3, points: int = 4, seed: int = 0, layout: RowLayout = LAYOUT
) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(seed)
    sizes = [layout.x_size, *[16] * (layers - 1), layout.y_size]
    arrays: dict[str, np.ndarray] = {}
    for i, (a, b) in enumerate(pairwise(sizes)):
        arrays[f"W{i}"] = rng.normal(0, 0.2, (points, b, a)).astype(np.float32)
        arrays[f"b{i}"] = rng.normal(0, 0.1, (points, b)).astype(np.float32)
    for name, size in (("X", layout.x_size), ("Y", layout.y_size)):
        arrays[f"{name}mean"] = rng.normal(size=size).astype(np.float32)
        arrays[f"{name}std"] = (rng.random(size) + 0.5).astype(np.float32)
    channels = {"injury": ["Hips-Arm"]} if layout.channels else {}
    meta = {"layout": layout.to_dict(), "skeleton": SKELETON, "channels": channels}
    return {**arrays, "meta": np.array(json.dumps(meta))}


@pytest.fixture
def weights(tmp_path: Path) -> Path:
    np.savez(tmp_path / "weights.npz", **make_network())
    return tmp_path / "weights.npz"


@pytest.mark.shared
def test_the_released_network_on_the_original_rows(shared):
    network = load_network(shared / "reference" / "pfnn_release_network.npz")
    with np.load(shared / "reference" / "original_rows_LocomotionFlat09_000.npz") as file:
        x, y, p, released = (file[name] for name in ("X", "Y", "P", "Y_release"))
    predicted = network.predictor("constant", "float32").predict(x, p.astype(float))
    np.testing.assert_allclose(predicted, released, atol=1e-3)
    errors = joint_errors(RowLayout(31), y, predicted, range(31))
    assert round(float(errors[..., 0].mean()), 4) == 0.0438
    assert 2.3 < errors[..., 1].mean() < 2.7
    # The exact prediction at the phases that the mode constant stores is the same prediction.
    stored = at_stored_phases(network, predict_function(network))(x, p.astype(float))
    np.testing.assert_allclose(stored, predicted, atol=1e-3)
    smooth = joint_errors(RowLayout(31), y, network.predict(x, p), range(31))
    assert (
        round(float(smooth[..., 0].mean()), 4) == 0.0436
    )  # with each row's own phase instead of that of its bin


def test_an_error_of_a_tenth_in_one_joint_gives_the_documented_error():
    layout = RowLayout(2)
    truth, predicted = np.zeros((2, 1, layout.y_size))
    block = layout.y_joint_position
    truth[0, block] = [0, 90, 0, 3, 0, 4]
    predicted[0, block] = [0, 81, 0, 3, 0, 4.5]
    errors = joint_errors(layout, truth, predicted, [0, 1])
    np.testing.assert_allclose(errors[0], [[0.1, 9.0], [0.1, 0.5]])
    np.testing.assert_allclose(joint_errors(layout, truth, predicted, [1])[0], [[0.1, 0.5]])
    at_root = joint_errors(layout, np.zeros_like(truth), predicted, [0, 1])
    assert np.isfinite(at_root).all()


@pytest.mark.parametrize("fits", [1, 10])
def test_the_errors_of_a_clip_cover_all_its_pairs(weights, fits):
    network = load_network(weights)
    rows = make_rows("a", 37, fits, 5)
    relative, distance = [], []
    for pairs in pair_batches(rows, rows.layout):
        errors = joint_errors(LAYOUT, pairs.y, network.predict(pairs.x, pairs.p), range(3))
        relative.append(errors[..., 0])
        distance.append(errors[..., 1])
    got = clip_errors(network, rows, [0, 1, 2]).to_dict()
    fast = clip_errors(network, rows, [0, 1, 2], predict_function(network)).to_dict()
    assert fast == pytest.approx(got, rel=1e-4)
    assert got["frames"] == 37
    assert got["mean"] == pytest.approx(np.concatenate(relative).mean())
    assert got["sd"] == pytest.approx(np.concatenate(relative).std())
    assert got["position_error_cm"] == pytest.approx(np.concatenate(distance).mean())
    for name, share in QUANTILES.items():
        assert got[name] == pytest.approx(np.quantile(np.concatenate(relative), share), rel=0.05)


def test_accuracy_per_clip_and_split(weights, tmp_path):
    clips = {}
    for i, (name, n, fits) in enumerate((("b", 20, 1), ("a", 40, 10), ("c", 30, 1), ("none", 0, 1))):
        clips[name] = tmp_path / f"{name}.npz"
        save_clip_rows(clips[name], make_rows(name, n, fits, i))
    splits = {"a": "train", "b": "train", "c": "held_out", "none": "held_out"}
    result = measure_accuracy(weights, clips, splits, "injured")
    assert result["configuration"] == "injured"
    assert [e["clip"] for e in result["clips"]] == ["a", "b", "c", "none"]
    by_name = {e["clip"]: e for e in result["clips"]}
    a, b, c = (by_name[n] for n in "abc")
    assert result["train"]["frames"] == 60
    for key in ("mean", "position_error_cm"):  # every frame counts the same, whatever its fits
        assert result["train"][key] == pytest.approx((40 * a[key] + 20 * b[key]) / 60)
    assert result["train"]["mean_of_clips"] == pytest.approx((a["mean"] + b["mean"]) / 2)
    assert {k: result["held_out"][k] for k in ("frames", "mean", "sd")} == {
        k: c[k] for k in ("frames", "mean", "sd")
    }
    assert by_name["none"]["mean"] is None
    # Nearly the same in the mode constant, and with n - 1.
    means = [e["as_published"]["mean"] for e in (a, b)]
    assert means == pytest.approx([a["mean"], b["mean"]], rel=0.05)
    assert means != [a["mean"], b["mean"]]
    assert result["train"]["as_published"] == {
        "mean_of_clips": pytest.approx(np.mean(means)),
        "sd_of_clips": pytest.approx(np.std(means, ddof=1)),
    }
    assert result["held_out"]["as_published"]["sd_of_clips"] is None
    json.dumps(result, allow_nan=False)
    write_csv(tmp_path / "clips.csv", clips_table(result))
    with open(tmp_path / "clips.csv", newline="") as file:
        table = list(csv.DictReader(file))
    assert [row["clip"] for row in table] == ["a", "b", "c", "none"]
    assert float(table[2]["mean"]) == c["mean"]
    assert result == measure_accuracy(weights, clips, splits, "injured")


def test_only_the_first_positions_of_a_clip_count_as_published(weights, tmp_path, monkeypatch) -> None:
    """Of three joints, 30 positions are those of ten frames; a frame counts with all its fits."""
    rows = make_rows("a", 40, 10, 0)
    save_clip_rows(tmp_path / "a.npz", rows)
    monkeypatch.setattr("hobble.measures.accuracy_run.PUBLISHED_POSITIONS", 32)
    (clip,) = measure_accuracy(weights, {"a": tmp_path / "a.npz"}, {"a": "train"}, "x")["clips"]
    network = load_network(weights)
    constant = at_stored_phases(network, predict_function(network))
    expected = clip_errors(network, rows.part(slice(10)), [0, 1, 2], constant).to_dict()
    assert clip["frames"] == 40
    assert clip["as_published"] == {key: expected[key] for key in ("frames", "mean", "sd")}
    assert clip["as_published"]["frames"] == 10


def test_equivalent_joints_leave_out_joints_of_larger_skeletons(weights, tmp_path):
    for skeleton, expected in (
        ({"maps": {"holden31": {"Foot": "LeftFoot", "Hips": "Hips"}}}, ["Foot", "Hips"]),
        ({"joints": {}}, None),
    ):
        (tmp_path / "skeleton.yaml").write_text(json.dumps(skeleton))
        inputs = MeasureInputs("x", {"skeleton": tmp_path / "skeleton.yaml"})
        assert joints_to_measure(inputs, JointOptions(joints="equivalent")) == expected
        assert joints_to_measure(inputs, JointOptions()) is None
    network = load_network(weights)
    assert joint_indices(network, ["Foot", "Hips"]) == [0, 2]
    assert joint_indices(network) == [0, 1, 2]
    with pytest.raises(HobbleError, match="Tail"):
        joint_indices(network, ["Tail"])
    save_clip_rows(tmp_path / "a.npz", make_rows("a", 20, 1, 0))
    some = measure_accuracy(weights, {"a": tmp_path / "a.npz"}, {"a": "train"}, "ava-m", ["Foot", "Hips"])
    assert some["joints"] == 2
    direct = clip_errors(network, make_rows("a", 20, 1, 0), [0, 2]).to_dict()
    assert some["clips"][0]["mean"] == pytest.approx(direct["mean"])


def test_rows_of_another_layout_are_refused(weights, tmp_path):
    other = make_rows("a", 0, 1, 0)
    save_clip_rows(
        tmp_path / "a.npz",
        replace(
            other, layout=RowLayout(4, channels=(("injury", 1),)), x=np.zeros((0, 144)), y=np.zeros((0, 68))
        ),
    )
    with pytest.raises(InputError, match=r"a\.npz: its rows .* are not those the network has learnt"):
        measure_accuracy(weights, {"a": tmp_path / "a.npz"}, {"a": "train"}, "holden")
