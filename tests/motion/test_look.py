"""The lines, and the page, about the clips of a folder."""

import json
import re
import shutil

import numpy as np
import pytest

from hobble.cli.__main__ import main
from hobble.core.bvh import write_bvh
from hobble.motion import look as module
from hobble.motion.look import PICTURES, WRONG, look_page, summarise_clips
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


def test_a_page_lists_every_clip_and_of_very_many_draws_a_sample(walker, holden31, monkeypatch):
    """The sample has those with a warning, and is spread over the others."""
    clip, numbers, count = walker(holden31, 240, 60.0), list[int](), 10_000
    monkeypatch.setattr(module, "MOST_READ", 40)
    report = {"rig": "<rig>", "source_fps": 120.0, "seconds": 4.0, "repairs": [], "retarget": None}
    reports = [report | {"clip": f"clip-{n:05}", "sha256": str(n)} for n in range(count)]
    reports[123]["unsure"] = ["no idea"]
    label = {"cycles": 3, "seconds": {"walk": 4.0, "jog": 0.0}}
    labels = [label | {"warnings": ["odd & new"] if n in (7, 9_876) else []} for n in range(count)]
    page = look_page("mine", reports, labels, lambda n: numbers.append(n) or (clip, np.ones((10, 4))))
    assert len(numbers) == 40 == page.count("<canvas")
    assert {7, 123, 9_876} <= set(numbers)
    assert np.diff(numbers).max() < 3 * count / 40
    assert page.count("<tr>") == count + 1
    for text in ("&lt;rig&gt;", "odd &amp; new", "walk 4.0", "only 40 clips were read"):
        assert text in page
    assert "http" not in page
    assert len(page.encode()) < 25e6
    data = json.loads(re.search(r'id="d">(.*?)</script>', page)[1])
    assert [len(one["p"]) for one in data] == [40] * 40
