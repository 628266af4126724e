"""`keep: best` and `patience`."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core.errors import HobbleError
from hobble.database.reader import Database
from hobble.training import train
from hobble.training.checkpoint import State

from .conftest import run_in

Settings = dict[str, Any]
# Noise that grows: a rate at which the error falls for some sections and then rises.
WILD = {"passes": 6, "dropout": 0.0, "l1": 0.0, "learning_rate": 0.02}


@pytest.fixture
def go(data: Database, network: Settings, training: Settings, tmp_path: Path) -> Callable[..., State]:
    def go(folder: str = "checkpoints", **changes: Any) -> State:
        settings = training | {**WILD, **changes}
        return train.train(data, network=network, training=settings, checkpoints=tmp_path / folder, threads=1)

    return go


def held_out(state: State) -> list[float]:
    return [row[5] for row in state.history]


def first_end(errors: list[float], patience: int) -> int:
    """The number of sections after which a training ends, counted by hand."""
    best, since = np.inf, 0
    for number, error in enumerate(errors, 1):
        best, since = (error, 0) if error < best else (best, since + 1)
        if since == patience:
            return number
    return len(errors)


def test_training_ends_after_that_many_sections_without_a_lower_error(go: Callable[..., State]) -> None:
    patience = 2
    whole = held_out(go("whole"))
    expected = first_end(whole, patience)
    stopped = go("stopped", patience=patience)
    assert held_out(stopped) == whole[:expected], "the same training, cut short"
    assert stopped.sections_done == expected
    again = go("stopped", patience=patience)
    assert again.sections_done == expected, "called again it stays ended"
    assert go("stopped").sections_done == len(whole), "without patience it goes on"


def test_the_best_weights_are_written_and_the_checkpoint_keeps_the_last(
    small_database: Path, network: Settings, training: Settings, tmp_path: Path
) -> None:
    best, last = (
        run_in(tmp_path / keep, small_database, network, training | {**WILD, "keep": keep})
        for keep in ("best", "last")
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


@pytest.mark.parametrize("changes", [{"keep": "best"}, {"patience": 3}])
def test_keep_best_needs_held_out_clips(
    go: Callable[..., State], monkeypatch: pytest.MonkeyPatch, changes: Settings
) -> None:
    monkeypatch.setattr(Database, "row_count", lambda self, split: 0)
    with pytest.raises(HobbleError, match="no clip is held out"):
        go(**changes)
