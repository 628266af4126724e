"""Training learns, logs, is reproducible, and stops when it diverges; what a network's file holds."""

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from hobble.core import files
from hobble.core.errors import HobbleError, InputError
from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.database.write import write_database
from hobble.models.load import load_network
from hobble.models.matching import MatchingOptions
from hobble.models.network import TrainingFacts
from hobble.rows.clip_rows import save_clip_rows
from hobble.training import Training
from hobble.training.batches import HeldOutErrors, HostRows
from hobble.training.checkpoint import State, write_history
from hobble.training.optimiser import Adam, Update
from tests.models.matching.example import FRAMES, clip

from .conftest import run_in

Settings = dict[str, Any]
Run = Callable[..., State]
CPU = torch.device("cpu")


def test_a_training_lowers_the_error_on_held_out_rows(go: Run) -> None:
    state = go(passes=10, learning_rate=3e-3, dropout=0.0, l1=0.0)
    first, last = state.history[0], state.history[-1]
    assert last[4] < 0.02 * first[4]
    assert last[5] < 0.8 * first[5]


@pytest.mark.parametrize("size", [32, 300])
def test_batches_are_the_sections_samples_in_order(data: Database, size: int) -> None:
    seen = list(HostRows(data, CPU).batches(1, 2, 3, seed=5, size=size))
    blocks = list(data.blocks("train", 1, 2, 3, 5))
    assert [len(batch.p) for batch in seen[:-1]] == [size] * (len(seen) - 1)
    assert 0 < len(seen[-1].p) <= size
    *columns, whole = zip(*seen, strict=True)
    for mine, theirs in zip(columns, [*zip(*blocks, strict=True)][:4], strict=True):
        assert np.array_equal(np.concatenate(mine), np.concatenate(theirs))
    assert sum(len(batch.p) for batch in seen) == sum(whole) == data.section_sample_count("train", 2, 3)


def test_history_counts_and_agrees_with_the_network(go: Run, data: Database, tmp_path: Path) -> None:
    state = go()
    path, blocks = tmp_path / "history.csv", data.layout.blocks("y")
    write_history(path, blocks, state.history)
    rows = list(csv.DictReader(path.open()))
    first = ["pass", "section", "samples", "seconds", "train_mse", "held_out_mse"]
    assert list(rows[0]) == [*first, *(f"held_out_{name}" for name in blocks)]
    assert [(row["pass"], row["section"]) for row in rows] == [(p, s) for p in "12" for s in "123"]
    assert [int(row["samples"]) for row in rows] == [766, 1533, 2300, 3066, 3833, 4600]
    seconds = [float(row["seconds"]) for row in rows]
    assert seconds == sorted(seconds)
    block = next(data.blocks("held_out", 0, 0, data.manifest.visits, 0))
    assert len(block.p) == data.row_count("held_out")
    y = state.network(torch.from_numpy(block.x), torch.from_numpy(block.p)).numpy()
    squares = (y - block.y) ** 2
    assert float(rows[-1]["held_out_mse"]) == pytest.approx(float(squares.mean()), rel=1e-5)
    for name, part in blocks.items():
        assert float(rows[-1][f"held_out_{name}"]) == pytest.approx(float(squares[:, part].mean()), rel=1e-5)


def test_divergence_stops_the_training_names_the_clips_and_keeps_the_last_checkpoint(
    go: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    blocks = Database.blocks

    def broken(self: Database, split: str, *place: int) -> Any:
        for block in blocks(self, split, *place):
            if (split, *place[:2]) == ("train", 1, 1):
                block.y[40, 3] = np.nan
            yield block

    monkeypatch.setattr(Database, "blocks", broken)
    said = r"diverged in pass 2 of 2, section 2 of 3, batch 2: its error is nan\. .* frames of hop, walk\."
    with pytest.raises(HobbleError, match=said):
        go()
    kept = files.load_npz(next(tmp_path.glob("checkpoints/*/checkpoint.npz")))
    assert int(kept["sections"]) == 4
    assert np.isfinite(kept["weights"]).all()


@pytest.mark.parametrize("asked", [{"other_paces": 1.2}, {"other_poses": 0.5}, {"rollout": 4}])
def test_changed_batches_train_another_network(go: Run, asked: Settings) -> None:
    plain, other = (go(str(options), passes=1, batch=90, **options).network for options in ({}, asked))
    assert not torch.equal(plain.flat, other.flat)


@pytest.mark.parametrize("keep", [True, False])
def test_dropout_keeps_the_channels_only_if_asked(
    go: Run, data: Database, monkeypatch: pytest.MonkeyPatch, keep: bool
) -> None:
    dropped: list[float] = []

    def drawn(self: Update, *rest: Any) -> Any:
        masks = of_update(self, *rest)
        assert (masks[0] == 0).any(), "other inputs are dropped"
        dropped.append(float((masks[0][:, data.layout.x_channel("injury")] != 1).float().mean()))
        return masks

    of_update = Update._masks
    monkeypatch.setattr(Update, "_masks", drawn)
    go(passes=1, sections=2, batch=90, dropout=0.2, keep_channels=keep)
    assert (max(dropped) == 0) == keep


def test_each_batch_has_the_rate_of_its_place(
    go: Run, training: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rate depends only on the number of samples so far."""
    fast = {"schedule": "cosine", "warm_up": 0.5, "rollout": 4, "batch": 300}
    rates: list[float] = []
    step = Adam.step

    def noted(self: Adam, gradients: list[torch.Tensor], rate: float = 1.0) -> None:
        rates.append(rate)
        step(self, gradients, rate)

    monkeypatch.setattr(Adam, "step", noted)
    go(**fast)
    sizes = [300, 300, 166, 300, 300, 167, 300, 300, 167] * 2
    seen = np.cumsum([0, *sizes])[: len(sizes)]
    assert rates == pytest.approx([(training | fast).learning_rate_share(n / 2300) for n in seen])


def test_the_best_weights_are_written_and_the_checkpoint_keeps_the_last(
    small_database: Path, network: Settings, training: Settings, tmp_path: Path
) -> None:
    # At this rate the error falls for some sections and then rises.
    wild = training | {"passes": 6, "dropout": 0.0, "l1": 0.0, "learning_rate": 0.02}
    best, last = (
        run_in(tmp_path / keep, small_database, network, wild | {"keep": keep}) for keep in ("best", "last")
    )
    checkpoint = dict(np.load(last / "checkpoint.npz"))
    for name, value in np.load(best / "checkpoint.npz").items():
        if name not in ("seconds", "history"):
            np.testing.assert_array_equal(value, checkpoint[name], err_msg=name)
    assert not np.array_equal(checkpoint["weights"], checkpoint["best"])
    meta = [json.loads(str(np.load(folder / "weights.npz")["meta"])) for folder in (best, last)]
    errors = checkpoint["history"][:, 5]
    assert meta[0]["best_section"] == int(errors.argmin()) + 1 < len(errors)
    assert "best_section" not in meta[1]
    assert meta[0]["held_out_mse"] == pytest.approx(errors.min(), rel=1e-5), "all held-out rows are measured"
    assert meta[1]["held_out_mse"] == pytest.approx(errors[-1], rel=1e-5)


# The weight of the phase in the loss, and channels whose inputs are divided.


def block_of(data: Database) -> tuple[np.ndarray, np.ndarray]:
    made = next(data.blocks("train", 0, 0, 1, 1, block_rows=10_000))
    return made.x, made.y


def test_only_the_error_of_the_phase_gets_the_weight(data: Database) -> None:
    heavy = Database.open(data.path, 64, 8.0)
    (x, y), (weighted_x, weighted_y) = block_of(data), block_of(heavy)
    at = data.layout.y_phase_change.start
    assert np.array_equal(weighted_x, x)
    np.testing.assert_allclose(weighted_y[:, at], 8 * y[:, at], rtol=1e-4, atol=1e-5)
    assert np.array_equal(np.delete(weighted_y, at, axis=1), np.delete(y, at, axis=1))
    raw, weighted = (
        values * each.statistics.y_std + each.statistics.y_mean
        for values, each in ((y, data), (weighted_y, heavy))
    )
    np.testing.assert_allclose(weighted, raw, rtol=1e-4, atol=1e-5)
    # Held-out errors, here of a network that predicts the means, do not depend on it.
    means = lambda x, p: torch.zeros(len(x), data.layout.y_size)  # noqa: E731
    errors = [HeldOutErrors(each, CPU, 0).errors(means, every_row=True) for each in (data, heavy)]
    assert errors[0] == pytest.approx(errors[1], rel=1e-4)


def test_only_the_inputs_of_a_divided_channel_are_smaller(data: Database) -> None:
    """Raw values stay the same, so a network of the divided rows takes the same severities as any other."""
    divided = Database.open(data.path, 64, scales={"injury": 5.0})
    (x, y), (divided_x, divided_y) = block_of(data), block_of(divided)
    columns = data.layout.x_channel("injury")
    assert np.abs(x[:, columns]).max() > 0
    np.testing.assert_allclose(5 * divided_x[:, columns], x[:, columns], rtol=2e-3, atol=1e-6)
    assert np.array_equal(np.delete(divided_x, columns, axis=1), np.delete(x, columns, axis=1))
    assert np.array_equal(divided_y, y)
    raw = [block_of(d)[0] * d.statistics.x_std + d.statistics.x_mean for d in (data, divided)]
    np.testing.assert_allclose(*raw, rtol=2e-3, atol=1e-3)
    with pytest.raises(InputError, match="the channel mood is not in this database"):
        Database.open(data.path, 64, scales={"mood": 2.0})


# What the file of a network says about its training data.


@pytest.mark.parametrize("memory", [64, 0])
def test_the_ranges_cover_every_row_with_every_fit(small_database: Path, memory: int) -> None:
    data = Database.open(small_database, memory)
    s = data.statistics
    seen = TrainingFacts.from_rows(data.layout, data.each_row("train"), s)
    (block,) = data.blocks("train", 0, 0, 1, 0, data.sample_count("train"))
    x, y = block.x * s.x_std + s.x_mean, block.y * s.y_std + s.y_mean
    for name, values in (("x", x), ("y", y)):
        np.testing.assert_array_equal(getattr(seen, f"{name}_low"), values.min(axis=0))
        np.testing.assert_array_equal(getattr(seen, f"{name}_high"), values.max(axis=0))
    same = np.flatnonzero((x == seen.start_x).all(axis=1))  # the row to start from, with one of its grounds
    assert len(same)
    assert block.p[same[0]] == np.float32(seen.start_phase)
    columns = np.r_[data.layout.x_position, data.layout.x_direction]
    columns = np.r_[columns, data.layout.x_joint_position, data.layout.x_joint_velocity]
    far = np.square(block.x[:, columns]).mean(axis=1)
    assert (far < far[same[0]] - 1e-6).mean() < 0.01  # of many grounds, another may be nearer to the mean


def test_a_built_network_holds_the_training_clips_and_writes_the_same_files(
    holden31: Skeleton, tmp_path: Path
) -> None:
    rows, splits = {}, {"clip-0": "train", "clip-1": "held_out"}
    for number, name in enumerate(splits):
        rows[name] = tmp_path / f"{name}.npz"
        save_clip_rows(rows[name], clip(holden31, number))
    write_database(tmp_path / "all", rows, splits, channels=["injury"], joint_weight=0.1)
    recipe, made = Training(memory_mb=64, device="cpu"), []
    for clips in (rows, dict(reversed(rows.items()))):
        run_in(tmp_path, tmp_path / "all", MatchingOptions(), recipe, clips=clips)
        made.append((tmp_path / "weights.npz").read_bytes())
    assert made[0] == made[1]
    network = load_network(tmp_path / "weights.npz")
    assert network.frames.shape[0] == FRAMES[0]
    assert network.channels["injury"]
    (row,) = csv.DictReader((tmp_path / "history.csv").read_text().splitlines())
    assert (row["pass"], row["section"], row["samples"]) == ("1", "1", str(FRAMES[0] + 1))
    assert row["train_mse"] == ""
    data = Database.open(tmp_path / "all", 64)
    s, squares, count = data.statistics, 0.0, 0
    for block in data.blocks("held_out", 0, 0, data.manifest.visits, 0, 64):
        y = network.predict(block.x * s.x_std + s.x_mean, block.p)
        squares += np.square((y - s.y_mean) / s.y_std - block.y).mean(axis=1).sum()
        count += len(y)
    assert float(row["held_out_mse"]) == pytest.approx(squares / count, rel=1e-4)
