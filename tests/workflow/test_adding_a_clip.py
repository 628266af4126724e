"""A new clip runs its own jobs and the merge, but no job of another clip."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from hobble.database.reader import Database

pytestmark = [pytest.mark.workflow, pytest.mark.slow]

TARGET = "results/datasets/mine/database/injury"
DATASET = "skeleton: holden31\nfolder: mine\nmirror: false\nterrain: {patches: 100}\n"
OWN = ("motion_clips", "labels_clips", "channel_clips", "terrain_fits", "database_clips")


def put(clip: Path, folder: Path) -> None:
    """A clip with its other files, as a user would copy them into the data folder."""
    for file in clip.parent.glob(f"{clip.stem}[._]*"):
        shutil.copy2(file, folder)


def contents(path: Path) -> dict[str, tuple[int, bytes]]:
    """Time and content of each file, without Snakemake's own."""
    files = (file for file in path.rglob("*") if file.is_file() and not file.name.startswith("."))
    return {str(file.relative_to(path)): (file.stat().st_mtime_ns, file.read_bytes()) for file in files}


def test_a_new_clip_runs_only_its_own_jobs_and_the_merge(clips: list[Path], workflow) -> None:
    folder = workflow.folder / "mocap" / "mine"
    folder.mkdir(parents=True)
    (workflow.checkout / "config/datasets/mine.yaml").write_text(DATASET)
    asked = (TARGET, "--config", "mocap=mocap")
    put(clips[0], folder)
    workflow.run("-c2", *asked)
    rows = workflow.folder / "results/datasets/mine/database/clips"
    before = contents(rows)
    put(clips[1], folder)
    expected = dict.fromkeys((*OWN, "database_merge"), 1)
    assert workflow.planned(*asked) == expected
    workflow.run("-c2", *asked)
    after = contents(rows)
    assert {name: after[name] for name in before} == before
    assert set(Database.open(workflow.folder / TARGET).clips) == {clip.stem for clip in clips}
    assert "Nothing to be done" in workflow.run("-n", *asked)
