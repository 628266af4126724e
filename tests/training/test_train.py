"""Training learns, logs, is reproducible, and stops when it diverges."""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from hobble.core import files
from hobble.core.errors import HobbleError
from hobble.database.reader import Block, Database
from hobble.training import checkpoint, train
from hobble.training.batches import HostRows
from hobble.training.checkpoint import State, columns, write_history
from hobble.training.optimiser import Update

Settings = dict[str, Any]
Run = Callable[..., State]


@pytest.fixture
def run(data: Database, network: Settings, training: Settings, tmp_path: Path) -> Run:
    """Train with some settings changed, checkpoints under `folder`."""

    def go(folder: str = "checkpoints", begin: Path | None = None, **changes: Any) -> State:
        return train.train(
            data,
            network=network,
            training=training | changes,
            checkpoints=tmp_path / folder,
            threads=1,
            start=begin,
        )

    return go


def test_a_training_lowers_the_error_on_held_out_rows(run: Run) -> None:
    state = run(passes=10, learning_rate=3e-3, dropout=0.0, l1=0.0)
    first, last = state.history[0], state.history[-1]
    assert last[4] < 0.02 * first[4]
    assert last[5] < 0.8 * first[5]
    assert state.best_mse == min(row[5] for row in state.history)


@pytest.mark.parametrize("size", [32, 300])
def test_batches_are_the_sections_samples_in_order(data: Database, size: int) -> None:
    seen = list(HostRows(data, torch.device("cpu")).batches(1, 2, 3, seed=5, size=size))
    blocks = list(data.blocks("train", 1, 2, 3, 5))
    assert [len(batch.p) for batch in seen[:-1]] == [size] * (len(seen) - 1)
    assert 0 < len(seen[-1].p) <= size
    *columns, whole = zip(*seen, strict=True)
    for mine, theirs in zip(columns, zip(*blocks, strict=True), strict=True):
        assert np.array_equal(np.concatenate(mine), np.concatenate(theirs))
    assert sum(len(batch.p) for batch in seen) == sum(whole) == data.section_sample_count("train", 2, 3)


def test_history_counts_and_agrees_with_the_network(run: Run, data: Database, tmp_path: Path) -> None:
    state = run()
    path = tmp_path / "history.csv"
    write_history(path, data.layout.blocks("y"), state.history)
    rows = list(csv.DictReader(path.open()))
    assert list(rows[0]) == columns(data.layout.blocks("y"))
    assert [(row["pass"], row["section"]) for row in rows] == [(p, s) for p in "12" for s in "123"]
    assert [int(row["samples"]) for row in rows] == [766, 1533, 2300, 3066, 3833, 4600]
    seconds = [float(row["seconds"]) for row in rows]
    assert seconds == sorted(seconds)
    block = next(data.blocks("held_out", 0, 0, data.manifest.visits, 0))
    assert len(block.p) == data.row_count("held_out")
    y = state.network(torch.from_numpy(block.x), torch.from_numpy(block.p)).numpy()
    squares = (y - block.y) ** 2
    assert float(rows[-1]["held_out_mse"]) == pytest.approx(float(squares.mean()), rel=1e-5)
    for name, part in data.layout.blocks("y").items():
        assert float(rows[-1][f"held_out_{name}"]) == pytest.approx(float(squares[:, part].mean()), rel=1e-5)


def poisoned(data: Database, monkeypatch: pytest.MonkeyPatch, turn: int, value: float) -> None:
    """Make row 40 of section `turn` wrong."""
    blocks = Database.blocks

    def wrong(self: Database, split: str, p: int, section: int, sections: int, *rest: int) -> Any:
        for block in blocks(self, split, p, section, sections, *rest):
            if split == "train" and p * sections + section == turn:
                block.y[40, 3] = value
            yield block

    monkeypatch.setattr(Database, "blocks", wrong)


def test_a_row_that_is_not_finite_stops_training_and_is_named(
    run: Run, data: Database, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    clean: Block = next(data.blocks("train", 1, 1, 3, 1))
    poisoned(data, monkeypatch, 4, np.nan)
    with pytest.raises(HobbleError) as error:
        run()
    text = str(error.value)
    assert "pass 2 of 2, section 2 of 3, batch 2:" in text
    assert f"{data.clips[clean.clip[40]]} frame {clean.frame[40]}" in text
    kept = files.load_npz(next(tmp_path.glob("checkpoints/*/checkpoint.npz")))
    assert int(kept["sections"]) == 4
    assert np.isfinite(kept["weights"]).all()


def test_divergence_stops_the_training_and_names_the_clips(run: Run) -> None:
    with pytest.raises(
        HobbleError, match=r"diverged in pass 1 of 2, section \d of 3, batch \d+: .*(walk, hop|hop, walk)"
    ):
        run(learning_rate=300.0)


def test_cuda_without_a_gpu_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert checkpoint.choose_device("auto").type == "cpu"
    with pytest.raises(HobbleError, match=r"training\.device is cuda"):
        checkpoint.choose_device("cuda")


def test_more_sections_than_samples_are_refused(run: Run) -> None:
    with pytest.raises(HobbleError, match=r"2300 training samples are fewer than training\.sections, 3000"):
        run(sections=3000)


@pytest.mark.parametrize(("major", "half"), [(7, False), (8, True)])
def test_bfloat16_is_chosen_where_a_device_has_it(
    training: Settings, monkeypatch: pytest.MonkeyPatch, major: int, half: bool
) -> None:
    """PyTorch also calls bfloat16 supported if it is only emulated."""

    def supported(including_emulation: bool = True) -> bool:
        return including_emulation or major >= 8

    monkeypatch.setattr(torch.cuda, "is_bf16_supported", supported)
    rounds = checkpoint.rounds_to_bfloat16
    assert rounds(training | {"batch": 256}, torch.device("cuda")) is half
    assert rounds(training | {"batch": 32}, torch.device("cuda")) is False
    assert rounds(training | {"batch": 32, "precision": "bfloat16"}, torch.device("cpu")) is True


def test_a_resumed_training_keeps_the_precision_with_which_it_began(
    run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first part ran on a machine that multiplies bfloat16, the second does not."""
    half = {"batch": 256, "precision": "auto"}
    monkeypatch.setattr(checkpoint, "multiplies_bfloat16", lambda: True)
    whole = run("whole", **half)
    run("cut", passes=1, **half)
    monkeypatch.setattr(checkpoint, "multiplies_bfloat16", lambda: False)
    resumed, other = run("cut", **half), run("other", **half)
    assert resumed.half
    assert torch.equal(resumed.network.flat, whole.network.flat)
    assert not torch.equal(other.network.flat, whole.network.flat)


@pytest.mark.parametrize(
    "asked", [{"other_paces": 1.2, "keep_channels": True}, {"other_poses": 0.5}, {"rollout": 4}]
)
def test_training_changes_batches_only_if_asked_and_never_channels(
    run: Run, data: Database, given: list[torch.Tensor], asked: Settings
) -> None:
    for number, options in enumerate(({}, asked)):
        run(str(number), passes=1, sections=2, batch=90, **options)
    half, injury = len(given) // 2, data.layout.x_channel("injury")
    changed = 0
    for without, other in zip(given[:half], given[half:], strict=True):
        assert torch.equal(without[:, injury], other[:, injury])
        changed += int((without != other).any(dim=1).sum())
    assert 0 < changed <= sum(len(x) for x in given[:half])


@pytest.mark.parametrize("keep", [True, False])
def test_dropout_keeps_the_channels_only_if_asked(
    run: Run, data: Database, monkeypatch: pytest.MonkeyPatch, keep: bool
) -> None:
    dropped: list[float] = []

    def drawn(self: Update, *rest: Any) -> Any:
        masks = of_update(self, *rest)
        assert (masks[0] == 0).any(), "other inputs are dropped"
        dropped.append(float((masks[0][:, data.layout.x_channel("injury")] != 1).float().mean()))
        return masks

    of_update = Update._masks
    monkeypatch.setattr(Update, "_masks", drawn)
    run(passes=1, sections=2, batch=90, dropout=0.2, keep_channels=keep)
    assert (max(dropped) == 0) == keep
