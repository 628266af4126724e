"""The lines about the clips of a folder."""

from __future__ import annotations

import pytest

from hobble.cli.__main__ import main
from hobble.motion.look import ClipSummary, format_table, shared_warnings, summarise_clips


@pytest.fixture
def folder(tmp_path, walk, walker, holden31, bvh):
    bvh(walker(holden31, 600, 120.0), "healthy")
    return tmp_path


def seen(root, folder):
    return summarise_clips(folder, root / "config/skeletons/holden31.yaml", root / "config/skeletons")


def test_a_normal_walk_has_steps_and_no_warning(root, folder):
    (clip,) = seen(root, folder).clips
    assert (clip.rig, clip.fps) == ("holden31", 120)
    assert clip.cadence == pytest.approx(120, abs=15)  # two steps a second
    assert clip.speed == pytest.approx(100, abs=5)
    assert clip.warnings == ()


def test_duplicates_and_files_without_a_clip_are_reported(root, folder):
    (folder / "again.bvh").write_bytes((folder / "healthy.bvh").read_bytes())
    (folder / "helthy_injuries.txt").write_text("frames:600\n")
    text = format_table(seen(root, folder))
    assert "again and healthy are the same file" in text
    assert (
        "helthy_injuries.txt belongs to no clip and is not read. If it belongs to healthy, rename it." in text
    )
    assert "Nobody stands in these clips" in text


def test_a_refused_file_is_listed_with_its_message(root, folder):
    (folder / "broken.bvh").write_text("HIERARCHY\n")
    assert "broken  REFUSED" in format_table(seen(root, folder))


def test_a_warning_of_many_clips_is_printed_once():
    rare, common = "repaired: its floor", "The same for all."
    clips = [ClipSummary(str(i), warnings=(common, rare)) for i in range(6)]
    short, notes = shared_warnings(clips)
    assert notes == [f"6 of 6 clips: {common}"]
    assert [clip.warnings for clip in short] == [(rare,)] * 6
    assert shared_warnings(clips[:4]) == (clips[:4], [])


def test_a_draft_of_a_skeleton_file_is_printed(folder, capsys):
    assert main(["rig", str(folder / "healthy.bvh")]) == 0
    said = capsys.readouterr().out
    assert "  left_knee: 'LeftLeg'\n" in said
    assert "  'LeftLeg': {parent: 'LeftUpLeg', offset: [0, -41, 0]}\n" in said
