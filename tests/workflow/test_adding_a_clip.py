"""A new clip runs its own jobs and the merge, but no job of another clip."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

pytestmark = pytest.mark.workflow

TARGET = "results/datasets/mine/database/injury"
DATASET = "skeleton: holden31\nfolder: mine\nmirror: false\nterrain: {patches: 100}\n"


def put(clip: Path, folder: Path) -> None:
    """A clip with its other files, as a user would copy them into the data folder."""
    for file in clip.parent.glob(f"{clip.stem}[._]*"):
        shutil.copy2(file, folder)


def test_a_clip_more_makes_its_own_rows_and_the_merge(clips: list[Path], workflow) -> None:
    folder = workflow.folder / "mocap" / "mine"
    folder.mkdir(parents=True)
    (workflow.checkout / "config/datasets/mine.yaml").write_text(DATASET)
    asked = (TARGET, "--config", "mocap=mocap")
    put(clips[0], folder)
    workflow.run("-c2", *asked)
    first = workflow.folder / f"results/datasets/mine/database/clips/{clips[0].stem}.npz"
    before, rows = first.stat().st_mtime_ns, first.read_bytes()
    put(clips[1], folder)
    own = (
        "motion_clips",
        "labels_clips",
        "channel_clips",
        "terrain_fits",
        "database_clips",
        "database_merge",
    )
    assert workflow.planned(*asked) == dict.fromkeys(own, 1)
    workflow.run("-c2", *asked)
    assert (first.stat().st_mtime_ns, first.read_bytes()) == (before, rows)
    manifest = (workflow.folder / TARGET / "manifest.json").read_text()
    assert all(f'"{clip.stem}"' in manifest for clip in clips)
    assert "Nothing to be done" in workflow.run("-n", *asked)
