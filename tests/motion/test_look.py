"""The lines about the clips of a folder."""

import re
import shutil

import pytest

from hobble.cli.__main__ import main
from hobble.core.bvh import write_bvh
from hobble.motion.look import PICTURES, WRONG, ClipSummary, format_table, summarise_clips
from hobble.motion.skeleton_file import load_skeleton


def test_a_folder_is_described_with_duplicates_and_unused_files(root, tmp_path, walker, holden31, bvh):
    bvh(walker(holden31, 600, 120.0), "healthy")
    (tmp_path / "again.bvh").write_bytes((tmp_path / "healthy.bvh").read_bytes())
    (tmp_path / "helthy_injuries.txt").write_text("frames:600\n")
    skeletons = root / "config/skeletons"
    (clip, _), notes = summarise_clips(tmp_path, skeletons / "holden31.yaml", skeletons)
    assert (clip.rig, clip.fps, clip.warnings) == ("holden31", 120, ())
    assert clip.cadence == pytest.approx(120, abs=15)  # two steps a second
    assert clip.speed == pytest.approx(100, abs=5)
    text = " ".join(notes)
    assert "again and healthy are the same file" in text
    assert "helthy_injuries.txt belongs to no clip and is not read. If it belongs to healthy" in text
    assert "Nobody stands in these clips" in text


def test_a_warning_of_many_clips_is_printed_once():
    clips = [ClipSummary(str(i), warnings=(f"It is {i} cm too high.",)) for i in range(6)]
    lines = format_table(clips, ["A note."]).split("\n")
    assert lines[7:] == ["6 clips, such as 0: It is 0 cm too high.", "A note."]


def test_a_wrong_map_is_refused_with_the_joint_and_a_picture(root, walker, tmp_path, capsys) -> None:
    """Here the left arm follows the right one."""
    maps = shutil.copytree(root / "config/skeletons", tmp_path / "skeletons")
    file = maps / "mixamo55.yaml"
    text = file.read_text().replace("    LeftArm: LeftArm\n", "    LeftArm: RightArm\n")
    file.write_text(text.replace("    RightArm: RightArm\n", "    RightArm: LeftArm\n"))
    clip = tmp_path / "clip.bvh"
    write_bvh(clip, walker(load_skeleton(file).skeleton, 120, 60.0), decimals=6)
    given = ["look", str(clip), "--skeletons", str(maps), "--picture", str(tmp_path / "apart.svg")]
    assert main(given) == 1
    said = capsys.readouterr().out
    found = re.search(r"the (left|right) (upper arm|forearm|elbow) is \d+ degrees off its source", said)
    assert found, said
    assert "--picture apart.svg" in said
    drawn = (tmp_path / "apart.svg").read_text()
    assert found[0] in drawn
    assert {"upper arm": 1, "forearm": 1, "elbow": 2}[found[2]] * 4 * PICTURES == drawn.count(WRONG)
