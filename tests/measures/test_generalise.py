"""The benchmark that compares training recipes runs on a few rows. Nothing else calls it."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np

from hobble.core.skeleton import Skeleton
from hobble.database.reader import Database
from hobble.database.write import write_database
from hobble.models.pfnn import PfnnOptions
from hobble.rows.clip_rows import ClipRows, save_clip_rows
from hobble.rows.layout import RowLayout
from hobble.runtime.waypoints import Waypoint


def clip_rows(name: str, skeleton: Skeleton, count: int, seed: int) -> ClipRows:
    layout, rng = RowLayout(len(skeleton.joints)), np.random.default_rng(seed)
    return ClipRows(
        name,
        layout,
        skeleton.to_dict(),
        rng.normal(size=(count, layout.x_terrain.start)).astype(np.float32),
        rng.normal(size=(count, layout.y_size)).astype(np.float32),
        rng.random(count).astype(np.float32),
        {},
        np.arange(count),
        np.zeros(count, int),
        np.ones(count, int),
        rng.normal(size=(count, 36)).astype(np.float32),
        rng.normal(size=count).astype(np.float32),
    )


def test_the_benchmark_prints_one_line_for_each_recipe(
    root: Path, holden31: Skeleton, tmp_path: Path
) -> None:
    spec = importlib.util.spec_from_file_location("generalise", root / "benchmarks" / "generalise.py")
    assert spec is not None
    assert spec.loader is not None
    generalise = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generalise)
    clips = {name: clip_rows(name, holden31, 90, i) for i, name in enumerate(("walk", "turn"))}
    (tmp_path / "clips").mkdir()
    for name, rows in clips.items():
        save_clip_rows(tmp_path / "clips" / f"{name}.npz", rows)
    splits = {"walk": "train", "turn": "held_out"}
    write_database(tmp_path / "plain", clips, splits, channels=[], joint_weight=0.1)
    line = generalise.measure_recipe(
        Database.open(tmp_path / "plain", 64),
        {"passes": 1, "sections": 1, "memory_mb": 64, "device": "cpu"},
        1,
        PfnnOptions(units=16),
        # So near to each other that a lap is two frames.
        (Waypoint((0.0, 0.0), "walk", 2.5), Waypoint((0.0, 5.0), "walk", 2.5)),
    )
    words = line.split()
    assert len(words) == 2 + 3 + 4
    assert words[5] == "2/2"
    assert all(np.isfinite(float(word)) for word in words if word != "2/2")
