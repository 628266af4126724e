"""A new clip runs its own jobs, its shard and the merge, but no job of another clip."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from hobble.database.reader import Database
from hobble.workflow.datasets import shard_of

pytestmark = pytest.mark.workflow

SHARDS = 4
TARGET = "results/datasets/mine/database/injury"
DATASET = "skeleton: holden31\nfolder: mine\nmirror: false\nterrain: {patches: 100}\ndatabase: {shards: 4}\n"
OWN = ("motion_clips", "labels_clips", "channel_clips", "terrain_fits", "database_clips")


def put(clip: Path, folder: Path) -> None:
    """A clip with its other files, as a user would copy them into the data folder."""
    for file in clip.parent.glob(f"{clip.stem}[._]*"):
        shutil.copy2(file, folder)


def contents(path: Path) -> dict[str, tuple[int, bytes]]:
    """Time and content of each file, without Snakemake's own."""
    files = (file for file in path.rglob("*") if file.is_file() and not file.name.startswith("."))
    return {str(file.relative_to(path)): (file.stat().st_mtime_ns, file.read_bytes()) for file in files}


def all_rows(path: Path) -> tuple[list[tuple[str, int]], np.ndarray]:
    """Clip and frame of each training row, and its output in raw units, in order."""
    db = Database.open(path, 4096)
    (block,) = db.blocks("train", 0, 0, db.manifest.visits, 1, db.row_count("train"))
    order = np.lexsort((block.frame, np.array(db.clips)[block.clip]))
    names = [(db.clips[block.clip[n]], int(block.frame[n])) for n in order]
    lowered = block.y * db.statistics.y_std + db.statistics.y_mean
    return names, lowered[order][:, db.layout.y_root_velocity]


def test_a_new_clip_runs_only_its_own_jobs_its_shard_and_the_merge(clips: list[Path], workflow) -> None:
    shards = [shard_of(clip.stem, SHARDS) for clip in clips]
    assert len(set(shards)) == 2
    folder = workflow.folder / "mocap" / "mine"
    folder.mkdir(parents=True)
    (workflow.checkout / "config/datasets/mine.yaml").write_text(DATASET)
    asked = (TARGET, "--config", "mocap=mocap")
    put(clips[0], folder)
    workflow.run("-c2", *asked)
    rows = workflow.folder / "results/datasets/mine/database/clips"
    shard = workflow.folder / f"results/datasets/mine/database/shards/injury/{shards[0]}"
    before, shard_before = contents(rows), contents(shard)
    assert f"train/{0:05d}.safetensors" in shard_before
    put(clips[1], folder)
    expected = dict.fromkeys((*OWN, "database_shard", "database_merge"), 1)
    assert workflow.planned(*asked) == expected
    workflow.run("-c2", *asked)
    after = contents(rows)
    assert {name: after[name] for name in before} == before
    assert contents(shard) == shard_before
    assert set(Database.open(workflow.folder / TARGET).clips) == {clip.stem for clip in clips}
    assert "Nothing to be done" in workflow.run("-n", *asked)

    in_shards = all_rows(workflow.folder / TARGET)
    workflow.edit("config/datasets/mine.yaml", "shards: 4", "shards: 1")
    assert workflow.planned(*asked) == {"database_merge": 1}
    workflow.run("-c2", *asked)
    in_one = all_rows(workflow.folder / TARGET)
    assert in_shards[0] == in_one[0]
    np.testing.assert_allclose(in_shards[1], in_one[1], atol=1e-5)
