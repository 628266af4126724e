"""A network that is kept symmetric gives mirrored outputs for mirrored inputs."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.database.write import write_database
from hobble.models.blend import TrainableBlend
from hobble.models.model import Options
from hobble.models.pfnn import PfnnOptions
from hobble.models.plain import PlainOptions
from hobble.rows.layout import mirror_of_x, mirror_of_y
from hobble.training.checkpoint import State

from .conftest import SPLITS, clip_rows, figure

Run = Callable[..., State]

NETWORKS = [
    PfnnOptions(units=24),
    PfnnOptions(units=25, hidden_layers=1, control_points=6),
    PlainOptions(kind="plain", units=24),
]


@pytest.fixture
def data(tmp_path: Path) -> Database:
    """Rows of a figure with a left and a right link."""
    clips = {}
    for name, rows, seed in (("walk", 230, 1), ("turn", 70, 3)):
        made = clip_rows(name, rows, 1, seed)
        skeleton = replace(figure(), links=(("Hips", "LeftLeg"), ("Hips", "RightLeg"))).to_dict()
        injury = np.random.default_rng(seed).uniform(0, 10, (rows, 2)).astype(np.float32)
        layout = replace(made.layout, channels=(("injury", 2),))
        clips[name] = replace(made, layout=layout, skeleton=skeleton, channels={"injury": injury})
    path = tmp_path / "paired"
    write_database(path, clips, SPLITS, channels=["injury"], joint_weight=0.1)
    return Database.open(path, 64)


def apart(network: TrainableBlend, data: Database) -> float:
    """How far the output for mirrored inputs is from the mirrored output, in standard deviations."""
    skeleton, s = Skeleton.from_dict(data.skeleton), data.statistics
    x_mirror = mirror_of_x(data.layout, skeleton).for_standardised_rows(s.x_mean, s.x_std)
    y_mirror = mirror_of_y(data.layout, skeleton).for_standardised_rows(s.y_mean, s.y_std)
    assert max(np.abs(x_mirror.shift).max(), np.abs(y_mirror.shift).max()) > 0.05, (
        "the means are not symmetric"
    )
    x = np.random.default_rng(4).normal(size=(40, data.layout.x_size)).astype(np.float32)
    p = torch.linspace(0, 0.99, 40)
    y = network(torch.from_numpy(x), p).numpy()
    image = network(torch.from_numpy(x_mirror(x).astype(np.float32)), (p + 0.5) % 1).numpy()
    assert y.std() > 0.01
    return float(np.abs(y_mirror(y) - image).max())


@pytest.mark.parametrize("network", NETWORKS, ids=str)
def test_a_network_trained_so_mirrors_its_output(data: Database, network: Options, go: Run) -> None:
    free, kept = (go(f"{way}", rollout=3, batch=64, symmetric=way) for way in (False, True))
    assert apart(kept.network, data) < 1e-5
    assert apart(free.network, data) > 1e-2
