"""A change in the content of a user's file is seen, whatever its time, and only its clip is made again."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from hobble.workflow.contents import Contents

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


@pytest.mark.workflow
@pytest.mark.slow
def test_another_clip_with_an_older_time_and_an_edit_with_the_time_put_back_are_seen(clips, workflow) -> None:
    folder = workflow.folder / "mocap/mine"
    folder.mkdir(parents=True)
    (workflow.checkout / "config/datasets/mine.yaml").write_text(DATASET)
    asked = (TARGET, "--config", "mocap=mocap")
    for name, source in (("a", clips[0]), ("b", clips[1])):
        (folder / f"{name}.bvh").write_bytes(source.read_bytes())
    workflow.run("-c2", *asked)
    assert "Nothing to be done" in workflow.run("-n", *asked)
    motion = workflow.folder / "results/datasets/mine/motion"
    other, before = (motion / "b.npz").read_bytes(), (motion / "a.npz").read_bytes()
    stamp = (folder / "a.bvh").stat()
    text = (folder / "a.bvh").read_text()
    (folder / "a.bvh").write_text(text[:-200] + text[-200:].replace("1", "2"))
    os.utime(folder / "a.bvh", ns=(stamp.st_atime_ns - 10**13, stamp.st_mtime_ns - 10**13))
    assert workflow.planned(*asked)["motion_clips"] == 1
    workflow.run("-c2", *asked)
    assert (motion / "a.npz").read_bytes() != before
    assert (motion / "b.npz").read_bytes() == other
    (folder / "a.bvh").write_text(text)
    put_back_time(folder / "a.bvh", stamp)
    workflow.run("-c2", *asked)
    assert (motion / "a.npz").read_bytes() == before
    assert "Nothing to be done" in workflow.run("-n", *asked)
