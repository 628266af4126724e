"""A change in the content of a user's file is seen, whatever its time, and only its clip is made again."""

import os
import re
import time
from pathlib import Path

import pytest

from hobble.database.reader import Database
from hobble.workflow.fingerprint import Contents

TARGET = "results/datasets/mine/database/plain"
DATASET = "skeleton: holden31\nfolder: mine\nmirror: false\nterrain: {patches: 50}\n"


def put_back_time(path: Path, like: os.stat_result) -> None:
    os.utime(path, ns=(like.st_atime_ns, like.st_mtime_ns))


def test_hashes_follow_the_content_and_are_read_again_only_after_a_change(
    tmp_path: Path, monkeypatch
) -> None:
    clip, known = tmp_path / "a.bvh", tmp_path / "known.json"
    clip.write_text("one")
    before = clip.stat()
    first = Contents(tmp_path / "made", known)
    paths = [str(clip), "results/x", str(tmp_path / "made/b.bvh"), str(tmp_path / "missing")]
    (one,) = first.of(paths)
    first.keep()
    with monkeypatch.context() as patch:
        patch.setattr("builtins.open", lambda *a, **k: pytest.fail("an unchanged file was read"))
        again = Contents(tmp_path / "made", known)
        assert again.of(paths) == [one]
    time.sleep(0.02)
    clip.write_text("two")
    put_back_time(clip, before)
    assert Contents(tmp_path / "made", known).of(paths) != [one]
    known.write_text("[1")
    assert len(Contents(tmp_path / "made", known).of(paths)) == 1


OWN = ("motion_clips", "labels_clips", "channel_clips", "terrain_fits", "database_clips")


@pytest.mark.workflow
@pytest.mark.slow
def test_a_new_clip_and_another_content_with_an_older_time_run_only_their_own_jobs(clips, workflow) -> None:
    folder = workflow.folder / "mocap/mine"
    folder.mkdir(parents=True)
    (workflow.folder / "config/datasets/mine.yaml").write_text(DATASET)
    asked = (TARGET, "--config", "mocap=mocap")
    (folder / "a.bvh").write_bytes(clips[0].read_bytes())
    workflow.run("-c2", *asked)
    motion = workflow.folder / "results/datasets/mine/motion/a.npz"
    before, made = motion.read_bytes(), motion.stat().st_mtime_ns
    (folder / "b.bvh").write_bytes(clips[1].read_bytes())
    assert workflow.planned(*asked) == dict.fromkeys((*OWN, "database_merge"), 1)
    workflow.run("-c2", *asked)
    assert motion.stat().st_mtime_ns == made
    assert set(Database.open(workflow.folder / TARGET).clips) == {"a", "b"}
    other = motion.with_name("b.npz").read_bytes()
    text, stamp = (folder / "a.bvh").read_text(), (folder / "a.bvh").stat()
    # A digit after the decimal point in several rows: at 60 Hz, not every row of the file counts.
    (folder / "a.bvh").write_text(text[:-9000] + re.sub(r"(?<=\.\d)1", "2", text[-9000:]))
    os.utime(folder / "a.bvh", ns=(stamp.st_atime_ns - 10**13, stamp.st_mtime_ns - 10**13))
    assert workflow.planned(*asked)["motion_clips"] == 1
    workflow.run("-c2", *asked)
    assert motion.read_bytes() != before
    assert motion.with_name("b.npz").read_bytes() == other
    assert "Nothing to be done" in workflow.run("-n", *asked)
