"""A small database from which a network can learn, built as in the database stage."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.database.write import write_database
from hobble.models.pfnn import PfnnOptions
from hobble.rows.clip_rows import ClipRows
from hobble.rows.layout import RowLayout
from hobble.training import Training
from hobble.training.augment import Augmentation, RollOut
from hobble.training.batches import SampleBatch
from hobble.training.checkpoint import State
from hobble.training.train import run, train

SPLITS = {"walk": "train", "hop": "train", "turn": "held_out"}


def figure() -> Skeleton:
    """Four joints and one link: the least that a row can hold."""
    names = ("Hips", "LeftLeg", "RightLeg", "Head")
    return Skeleton("stick", names, (-1, 0, 0, 0), np.ones((4, 3)), {"hips": "Hips"}, (("Hips", "LeftLeg"),))


def clip_rows(name: str, rows: int, fits: int, seed: int) -> ClipRows:
    """Rows whose Y is a smooth function of two columns of X and of the phase, with some noise."""
    skeleton = figure()
    layout = RowLayout(joints=4, channels=(("injury", 1),))
    rng = np.random.default_rng(seed)
    columns = layout.x_terrain.start
    x = rng.normal(0, 2, (rows, columns)).astype(np.float32)
    x[:, layout.x_gait] *= 0.05  # all rows have about the same gait
    p = np.linspace(0, 3, rows, endpoint=False).astype(np.float32) % 1
    mix = np.random.default_rng(7).normal(0, 0.2, (2, 2, layout.y_size))
    turn = np.cos(2 * np.pi * p)[:, None]
    y = np.tanh(x[:, :2] @ mix[0]) * (1 + turn) + np.tanh(x[:, :2] @ mix[1]) * (1 - turn)
    heights = rng.normal(0, 5, (rows * fits, 3 * layout.samples)).astype(np.float32)
    return ClipRows(
        name,
        layout,
        skeleton.to_dict(),
        x,
        (y + rng.normal(0, 0.05, y.shape)).astype(np.float32),
        p,
        {"injury": rng.uniform(0, 10, (rows, 1)).astype(np.float32)},
        np.arange(60, 60 + rows),
        np.arange(rows) // 40,
        np.full(rows, fits),
        heights,
        rng.normal(0, 3, rows * fits).astype(np.float32),
        10,
    )


@pytest.fixture(scope="session")
def small_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """230 rows to train on and 70 held out, ten fits each or one: 2,300 samples a pass."""
    path = tmp_path_factory.mktemp("database") / "all"
    walk, turn = clip_rows("walk", 150, 1, 1), clip_rows("turn", 70, 1, 3)
    clips = {"walk": walk, "turn": turn, "hop": clip_rows("hop", 80, 10, 2)}
    write_database(path, clips, SPLITS, channels=["injury"], joint_weight=0.1)
    return path


@pytest.fixture
def data(small_database: Path) -> Database:
    return Database.open(small_database, 64)


@pytest.fixture
def network() -> PfnnOptions:
    return PfnnOptions(hidden_layers=2, units=24, control_points=4)


def run_in(folder: Path, database: Path, network: Any, training: Any, **more: Any) -> Path:
    """Train as the workflow does. Returns the folder with weights.npz, history.csv and checkpoint.npz."""
    files = {"weights": "weights.npz", "history": "history.csv", "checkpoint": "checkpoint.npz"}
    options = {name: folder / file for name, file in files.items()} | {"checkpoints": folder / "checkpoints"}
    options |= {"configuration": "example", "threads": 1, "start": None, "code": None} | more
    run(database, network=network, training=training, **options)
    return folder


class Recipe(Training):
    """A training section that tests change with `|`, as with mappings."""

    def __or__(self, changes: Mapping[str, Any]) -> Recipe:
        return Recipe.model_validate(self.model_dump() | dict(changes))


@pytest.fixture
def training() -> Recipe:
    return Recipe(passes=2, sections=3, learning_rate=1e-3, memory_mb=64, device="cpu")


@pytest.fixture
def go(data: Database, network: PfnnOptions, training: Recipe, tmp_path: Path) -> Callable[..., State]:
    """Trains with some settings changed. folder: of the checkpoints. start: another checkpoint."""

    def go(
        folder: str = "checkpoints", start: Path | None = None, kind: Any = network, **changes: Any
    ) -> State:
        options = {"network": kind, "training": training | changes, "checkpoints": tmp_path / folder}
        return train(data, **options, threads=1, start=start)

    return go


def change(
    augmentation: Augmentation, x: torch.Tensor, p: Any = None, clip: Any = None, y: Any = None
) -> None:
    """Let an augmentation change a batch of inputs x, and take note of it."""
    augmentation.change(SampleBatch(x, y, p, clip, len(x)))
    if not isinstance(augmentation, RollOut):  # which the tests tell its errors
        augmentation.after(x)
