"""A training that is interrupted, prolonged or continued ends with the same bits as an undisturbed one."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from hobble.core.errors import InputError
from hobble.core.files import load_npz, save_npz
from hobble.database.reader import Database
from hobble.rows.layout import CONTACTS, GAITS, RowLayout
from hobble.training.checkpoint import State, pack, recipe_hash
from hobble.training.train import train

from .conftest import run_in

Settings = dict[str, Any]


def test_more_passes_resume_and_fewer_start_again(
    data: Database, network: Settings, training: Settings, tmp_path: Path
) -> None:
    """A fraction of a pass is its first sections."""

    def to(passes: float, folder: str) -> State:
        settings = training | {"passes": passes}
        return train(data, network=network, training=settings, checkpoints=tmp_path / folder, threads=1)

    third, whole = to(1 / 3, "a"), to(1, "b")
    assert third.samples == data.section_sample_count("train", 0, 3) < data.sample_count("train")
    assert [row[:3] for row in third.history] == [row[:3] for row in whole.history[:1]]
    for passes in (1, 7 / 3):
        resumed = to(passes, "a")
        assert len(resumed.history) == round(3 * passes)
        assert torch.equal(resumed.network.flat, to(passes, f"to {passes}").network.flat)
    assert len(list((tmp_path / "a").iterdir())) == 1
    assert torch.equal(to(2, "a").network.flat, to(2, "c").network.flat)
    with pytest.raises(ValueError, match="whole number"):
        training | {"passes": 0.5}


def test_continuing_a_configuration_equals_one_longer_training(
    small_database: Path, data: Database, network: Settings, training: Settings, tmp_path: Path
) -> None:
    def go(name: str, passes: int, start: str | None) -> dict[str, np.ndarray]:
        recipe = training | {"passes": passes, "continues": start}
        begun = tmp_path / start / "checkpoint.npz" if start else None
        run_in(tmp_path / name, small_database, network, recipe, start=begun, code="fingerprint")
        return load_npz(tmp_path / name / "weights.npz")

    go("holden", 2, None)
    continued, scratch = go("holden-xt", 4, "holden"), go("scratch", 4, None)
    for name in continued:
        if name != "meta":
            assert np.array_equal(continued[name], scratch[name]), name
    assert len((tmp_path / "holden-xt" / "history.csv").read_text().splitlines()) == 1 + 4 * 3
    assert json.loads(str(continued["meta"]))["passes"] == 4
    names = ("holden-xt", "holden", "scratch")
    assert [load_npz(tmp_path / name / "checkpoint.npz")["steps"] for name in names] == [288, 144, 288]


def test_another_start_network_ignores_the_earlier_checkpoint(
    data: Database, network: Settings, training: Settings, tmp_path: Path
) -> None:
    """A run with its own recipe and another start does not use its earlier checkpoint."""

    def start(seed: int) -> Path:
        state = train(
            data, network=network, training=training | {"seed": seed}, checkpoints=tmp_path / f"start {seed}"
        )
        path = tmp_path / f"start {seed}.npz"
        save_npz(path, **pack(state))
        return path

    def go(folder: str, begun: Path | None) -> torch.Tensor:
        settings = training | {"passes": 3, "learning_rate": 5e-4}
        folders = {"checkpoints": tmp_path / folder, "start": begun}
        return train(data, network=network, training=settings, **folders).network.flat  # type: ignore[arg-type]

    first, second = start(1), start(2)
    one = go("run", first)
    assert torch.equal(go("run", second), go("fresh", second))
    assert torch.equal(go("run", None), go("scratch", None))
    assert torch.equal(go("run", first), one)
    assert not torch.equal(go("run", second), one)
    assert len(list((tmp_path / "run").iterdir())) == 3


def test_a_start_network_of_another_shape_is_refused(
    data: Database, network: Settings, training: Settings, tmp_path: Path
) -> None:
    """`hobble.workflow.targets` refuses other sections and fewer passes, before the run."""
    state, start = train(data, network=network, training=training, checkpoints=tmp_path), tmp_path / "s.npz"
    save_npz(start, **pack(state))
    other = network.model_copy(update={"units": 30})
    with pytest.raises(InputError, match=r"s\.npz: holds a network of \d+-24-24-.* not of .*-30-30-"):
        train(data, network=other, training=training, checkpoints=tmp_path / "b", start=start)


def test_the_weights_file_is_enough_for_the_runtime(
    small_database: Path, data: Database, network: Settings, training: Settings, tmp_path: Path
) -> None:
    first, again = (
        run_in(tmp_path / name, small_database, network, training, terrain_side=31.0) / "weights.npz"
        for name in ("first", "again")
    )
    assert first.read_bytes() == again.read_bytes()
    weights = load_npz(first)
    meta = json.loads(str(weights["meta"]))
    assert RowLayout.from_dict(meta["layout"]) == data.layout
    assert list(meta["skeleton"]["joints"]) == list(data.skeleton["joints"])
    assert (meta["gaits"], meta["contacts"]) == (list(GAITS), list(CONTACTS))
    assert (meta["channels"], meta["configuration"]) == ({"injury": ["Hips-LeftLeg"]}, "example")
    assert (meta["kind"], meta["terrain_side"]) == ("pfnn", 31.0)
    assert weights["W0"].shape == (4, 24, data.layout.x_size)
    assert weights["b2"].shape == (4, data.layout.y_size)
    block = next(data.blocks("held_out", 0, 0, data.manifest.visits, 0))
    p, y = np.array([0.25, 0.5]), []
    for row, phase in enumerate(p):  # at a control point the network is that control point's
        x = block.x[row]
        for layer in range(3):
            x = weights[f"W{layer}"][int(phase * 4)] @ x + weights[f"b{layer}"][int(phase * 4)]
            x = np.where(x > 0, x, np.expm1(x)) if layer < 2 else x
        y.append(x)
    state = train(
        data, network=network, training=training, checkpoints=tmp_path / "first/checkpoints", threads=1
    )
    ours = state.network(torch.from_numpy(block.x[:2]), torch.from_numpy(p.astype(np.float32)))
    assert np.allclose(ours.numpy(), np.stack(y), rtol=1e-4, atol=1e-4)


def test_the_recipe_hash_has_all_that_determines_a_training(
    data: Database, network: Settings, training: Settings
) -> None:
    name = recipe_hash(network, training, data, "code")
    assert name == recipe_hash(network, training | {"passes": 99, "continues": "x"}, data, "code")
    others = [
        recipe_hash(network.model_copy(update={"units": 25}), training, data, "code"),
        recipe_hash(network, training | {"learning_rate": 0.1}, data, "code"),
        recipe_hash(network, training, data, "other code"),
        recipe_hash(network, training | {"sections": 4}, data, "code"),
    ]
    assert len({name, *others}) == 5
