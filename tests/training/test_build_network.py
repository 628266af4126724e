"""A network that is built without training writes the same three files."""

import csv
from pathlib import Path

import numpy as np
import pytest

from hobble.core.errors import HobbleError
from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.database.write import write_database
from hobble.models.load import load_network
from hobble.models.matching import MatchingOptions
from hobble.rows.clip_rows import save_clip_rows
from hobble.training.options import Training
from tests.models.matching.example import FRAMES, clip

from .conftest import run_in

SPLITS = {"clip-0": "train", "clip-1": "held_out"}


@pytest.fixture
def files(holden31: Skeleton, tmp_path: Path) -> dict[str, Path]:
    """Both clips' rows; the first is trained on."""
    out = {}
    for number, name in enumerate(SPLITS):
        out[name] = tmp_path / f"{name}.npz"
        save_clip_rows(out[name], clip(holden31, number))
    write_database(tmp_path / "all", out, SPLITS, channels=["injury"], joint_weight=0.1)
    return out


def built(folder: Path, clips: dict[str, Path]) -> None:
    recipe = Training(memory_mb=64, device="cpu")
    run_in(folder, folder / "all", MatchingOptions(), recipe, clips=clips)


def test_a_built_network_holds_the_training_clips_and_has_a_held_out_error(files, tmp_path: Path) -> None:
    built(tmp_path, files)
    network = load_network(tmp_path / "weights.npz")
    assert network.frames.shape[0] == FRAMES[0]
    assert network.channels["injury"]
    (row,) = csv.DictReader((tmp_path / "history.csv").read_text().splitlines())
    assert (row["pass"], row["section"], row["samples"]) == ("1", "1", str(FRAMES[0] + 1))
    assert row["train_mse"] == ""
    data = Database.open(tmp_path / "all", 64)
    s, squares, rows = data.statistics, 0.0, 0
    for block in data.blocks("held_out", 0, 0, data.manifest.visits, 0, 64):
        y = network.predict(block.x * s.x_std + s.x_mean, block.p)
        squares += np.square((y - s.y_mean) / s.y_std - block.y).mean(axis=1).sum()
        rows += len(y)
    assert float(row["held_out_mse"]) == pytest.approx(squares / rows, rel=1e-4)
    assert not (tmp_path / "checkpoints").exists()


def test_equal_clips_give_equal_bytes(files, tmp_path: Path) -> None:
    built(tmp_path, files)
    first = (tmp_path / "weights.npz").read_bytes()
    built(tmp_path, dict(reversed(files.items())))
    assert (tmp_path / "weights.npz").read_bytes() == first


def test_a_clip_of_the_database_that_is_not_given_is_named(files, tmp_path: Path) -> None:
    with pytest.raises(HobbleError, match="clip-0"):
        built(tmp_path, {"clip-1": files["clip-1"]})
