"""The command `hobble`, called as on a command line."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from hobble.channels.injury.status import read_status
from hobble.cli import clips
from hobble.cli.__main__ import COMMANDS, main
from hobble.motion.read import read_bvh
from hobble.synthetic.generate_clip import Synthetic, write_clip


@pytest.fixture(scope="module")
def folder(tmp_path_factory, root: Path) -> Path:
    """Two clips of the procedural walker, and a file that is not BVH."""
    out = tmp_path_factory.mktemp("clips")
    skeleton = {"name": "holden31", **yaml.safe_load((root / "config/skeletons/holden31.yaml").read_text())}
    for name in ("one", "two"):
        others = dict.fromkeys(("footsteps", "gait"), out / "unused")
        write_clip(name, skeleton, 400, "walk", Synthetic(), bvh=out / f"{name}.bvh", **others)
    (out / "unused").unlink()
    (out / "broken.bvh").write_text("HIERARCHY\nnonsense\n")
    return out


def test_a_folder_of_clips_is_resampled_into_another_folder(folder, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["motion", str(folder), str(out), "--fps", "30", "--skeleton", "holden31", "--mirror"]) == 1
    assert sorted(p.name for p in out.iterdir()) == ["one.bvh", "one_mirror.bvh", "two.bvh", "two_mirror.bvh"]
    assert read_bvh(out / "one.bvh").frame_time == pytest.approx(1 / 30, abs=1e-6)
    assert "2 of 3 clips done, 1 failed" in capsys.readouterr().out


def test_a_clip_keeps_its_own_rig_and_settings_of_a_data_set_are_options(folder, tmp_path, capsys):
    """Each remedy that a refusal names is an option."""
    source = folder / "one.bvh"
    assert main(["motion", str(source), str(tmp_path), "--fps", "120", "--unit", "2"]) == 0
    before, after = read_bvh(source), read_bvh(tmp_path / "one.bvh")
    assert after.names == before.names
    np.testing.assert_allclose(after.offsets[1:], 2 * before.offsets[1:], atol=1e-4)
    assert main(["look", str(source), "--unit", "-1"]) == 1
    assert "hobble: unit" in capsys.readouterr().err


def test_existing_label_files_are_not_overwritten(folder, tmp_path, capsys):
    source = str(folder / "one.bvh")
    assert main(["labels", source, str(tmp_path), "--gait", "walk"]) == 0
    names = ["one_footsteps.txt", "one_gait.txt"]
    assert sorted(p.name for p in tmp_path.iterdir()) == names
    assert len((tmp_path / "one_footsteps.txt").read_text().splitlines()) > 3
    assert main(["labels", source, str(tmp_path)]) == 1
    assert "would be replaced" in capsys.readouterr().out
    assert main(["labels", source, str(tmp_path), "--overwrite"]) == 0


def test_what_a_machine_reads_is_json(folder, tmp_path, capsys):
    assert main(["look", str(folder), "--json"]) == 1
    clips = {clip["name"]: clip for clip in json.loads(capsys.readouterr().out)["clips"]}
    assert clips["broken"]["refused"]
    assert clips["one"]["fps"] == 120.0
    assert main(["labels", str(folder), str(tmp_path), "--json"]) == 1
    results = {result["clip"]: result for result in json.loads(capsys.readouterr().out)}
    assert "broken.bvh" in results["broken"]["error"]
    assert "cycles" in results["two"]["notes"][0]


def test_a_clip_is_hurt_and_its_status_file_says_how(folder, tmp_path, holden31, capsys):
    source = str(folder / "one.bvh")
    assert main(["hurt", source, str(tmp_path), "--injury", "left knee[8]", "--unit", "1"]) == 0
    status = read_status(tmp_path / "one_limps_injuries.txt", holden31.link_names)
    assert status.frames == len(read_bvh(tmp_path / "one_limps.bvh")) > len(read_bvh(source)) / 2
    assert status.spells[0].links == (("LeftUpLeg-LeftLeg", 8.0),)
    assert main(["hurt", source, str(tmp_path), "--injury", "LeftLeg-Tail[8]"]) == 1
    assert "no such link: LeftLeg-Tail" in capsys.readouterr().err


def test_a_bug_is_one_line_with_the_file_and_a_log(folder, tmp_path, monkeypatch, capsys):
    def broken(*arguments):
        raise KeyError("left knee")

    monkeypatch.setattr(clips, "make_clip", broken)
    assert main(["labels", str(folder / "one.bvh"), str(tmp_path)]) == 1
    monkeypatch.setattr(clips, "summarise_clips", broken)
    assert main(["look", str(folder)]) == 1
    said = capsys.readouterr()
    for line, name in ((said.out.splitlines()[0], "one.bvh"), (said.err.strip(), str(folder))):
        log = re.fullmatch(r".*: KeyError: 'left knee'\. .*report it with the log (\S+)", line)[1]
        assert name in line
        assert "Traceback" in Path(log).read_text()
        Path(log).unlink()


def test_a_reader_that_has_read_enough_ends_the_command_quietly(folder):
    command = [sys.executable, "-m", "hobble.motion", "look", str(folder)]
    done = subprocess.run(f"{shlex.join(command)} | true", shell=True, capture_output=True, text=True)
    assert done.stderr == ""


@pytest.mark.parametrize("shell", ["bash", "fish", "zsh"])
def test_a_shell_completes_commands_and_their_options(shell, capsys):
    assert main(["completion", shell]) == 0
    script = capsys.readouterr().out
    assert all(name in script for name in COMMANDS)
    if shell == "bash":
        for words, wanted in (("hobble mo", "motion"), ("hobble gait --hea", "--healthy")):
            call = f"COMP_WORDS=({words}); COMP_CWORD={words.count(' ')}; _hobble; echo ${{COMPREPLY[*]}}"
            done = subprocess.run(["bash", "-c", f"{script}\n{call}"], capture_output=True, text=True)
            assert done.stdout.strip() == wanted


@pytest.mark.shared
def test_a_hurt_cycle_that_the_command_repeated_can_be_labelled(shared: Path, tmp_path, capsys):
    """Injured_Walk_RUL leans to its sound side by 5.6 degrees; one cycle is too short to call that a tilt."""
    clip = shared / "mocap/ferre/Injured_Walk_RUL.bvh"
    assert main(["motion", str(clip), str(tmp_path / "eight"), "--loops", "8"]) == 0
    assert main(["labels", str(tmp_path / "eight"), str(tmp_path / "labels")]) == 0, capsys.readouterr().out
    assert len((tmp_path / "labels/Injured_Walk_RUL_footsteps.txt").read_text().splitlines()) > 5
