"""The command `hobble`, called as on a command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from hobble.cli.__main__ import main
from hobble.motion.read import read_bvh
from hobble.synthetic.generate_clip import write_clip
from hobble.synthetic.options import Synthetic


@pytest.fixture(scope="module")
def folder(tmp_path_factory, root: Path) -> Path:
    """Two clips of the procedural walker, and a file that is not BVH."""
    out = tmp_path_factory.mktemp("clips")
    skeleton = {"name": "holden31", **yaml.safe_load((root / "config/skeletons/holden31.yaml").read_text())}
    for name in ("one", "two"):
        others = {kind: out / f"{name}.{kind}" for kind in ("footsteps", "gait")}
        write_clip(
            name,
            skeleton,
            400,
            "walk",
            Synthetic(),
            bvh=out / f"{name}.bvh",
            **others,
        )
        for path in others.values():
            path.unlink()
    (out / "broken.bvh").write_text("HIERARCHY\nnonsense\n")
    return out


def test_a_folder_of_clips_is_resampled_into_another_folder(folder, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["motion", str(folder), str(out), "--fps", "30", "--skeleton", "holden31", "--mirror"]) == 1
    assert sorted(p.name for p in out.iterdir()) == ["one.bvh", "one_mirror.bvh", "two.bvh", "two_mirror.bvh"]
    assert read_bvh(out / "one.bvh").frame_time == pytest.approx(1 / 30, abs=1e-6)
    assert "2 of 3 clips done, 1 failed" in capsys.readouterr().out


def test_a_clip_keeps_its_own_rig_where_no_skeleton_is_named(folder, tmp_path):
    source = folder / "one.bvh"
    assert main(["motion", str(source), str(tmp_path), "--fps", "120"]) == 0
    before, after = read_bvh(source), read_bvh(tmp_path / "one.bvh")
    assert after.names == before.names
    assert np.abs(after.offsets[1:] - before.offsets[1:]).max() < 1e-3


def test_existing_label_files_are_not_overwritten(folder, tmp_path, capsys):
    source = str(folder / "one.bvh")
    assert main(["labels", source, str(tmp_path), "--gait", "walk"]) == 0
    names = ["one.phase", "one_footsteps.txt", "one_gait.txt"]
    assert sorted(p.name for p in tmp_path.iterdir()) == names
    assert len((tmp_path / "one_footsteps.txt").read_text().splitlines()) > 3
    capsys.readouterr()
    assert main(["labels", source, str(tmp_path)]) == 1
    assert "would be replaced" in capsys.readouterr().out
    assert main(["labels", source, str(tmp_path), "--overwrite"]) == 0


def test_a_missing_report_is_named_with_the_command_that_makes_it(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["play", "results/injured/report.html"]) == 1
    assert "snakemake -c2 results/injured/report.html" in capsys.readouterr().err
    page = tmp_path / "results" / "mine" / "report.html"
    page.parent.mkdir(parents=True)
    page.write_text("<html>")
    assert main(["play", "--print"]) == 0
    assert capsys.readouterr().out.strip() == page.as_uri() + "#play"


def test_help_lists_every_command(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--help"])
    assert stop.value.code == 0
    text = capsys.readouterr().out
    assert all(name in text for name in ("motion", "labels", "injury", "play"))
