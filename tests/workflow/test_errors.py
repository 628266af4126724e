"""Bad input in the real workflow gives one message with file and place. Finished files stay."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.workflow

# A figure of one bone, whatever its joints are called.
STICK = (
    """HIERARCHY
ROOT Hips
{
OFFSET 0 0 0
CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
End Site
{
OFFSET 0 90 0
}
}
MOTION
Frames: 200
Frame Time: 0.0083333
"""
    + "0 90 0 0 0 0\n" * 200
)
DATASET = "skeleton: holden31\nfolder: mine\n"


@pytest.fixture
def mine(clips: list[Path], workflow):
    """A user's data set of those two clips."""
    folder = workflow.folder / "mocap" / "mine"
    folder.mkdir(parents=True)
    for path in clips:
        for file in path.parent.glob(f"{path.stem}[._]*"):
            (folder / file.name).write_bytes(file.read_bytes())
    (workflow.folder / "config/datasets/mine.yaml").write_text(DATASET)
    workflow.clip, workflow.other = (path.stem for path in clips)
    workflow.mine = folder
    return workflow


def make(workflow, *targets: str, ok: bool) -> str:
    files = [f"results/datasets/mine/{target}" for target in targets]
    return workflow.run("-c2", *files, "--keep-going", "--config", "mocap=mocap", ok=ok)


def spoil(lines: list[str], how: str) -> str:
    motion = lines.index("MOTION")
    if how == "truncated":
        return "\n".join(lines[: motion + 30])
    if how == "nan":
        lines[motion + 10] = "nan " + lines[motion + 10].split(" ", 1)[1]
    if how == "skeleton":
        return STICK
    return "\n".join(lines)


BAD_CLIPS = {
    "truncated": ("line",),
    "nan": ("line", "frame 8"),
    "skeleton": (),
    "empty": ("empty",),
    "binary": (),
}
BAD_STATUS = {
    "wing": ("1-20 LeftWing-LeftTip[5];", ("line 2", "LeftWing-LeftTip")),
    "eleven": ("1-20 LeftUpLeg-LeftLeg[11];", ("line 2", "11", "10")),
    "back": ("20-1 LeftUpLeg-LeftLeg[5];", ("line 2", "20-1")),
    "short": ("frames:7", ("line 1", "7")),
}


def test_each_bad_file_is_refused_with_its_place_and_the_others_are_made(mine) -> None:
    """One run with five bad clips, four bad status files and two good clips."""
    good: Path = mine.mine / f"{mine.clip}.bvh"
    lines, frames = good.read_text().splitlines(), (mine.mine / f"{mine.clip}_injuries.txt").read_text()
    for number, name in enumerate([*BAD_CLIPS, *BAD_STATUS]):
        path = mine.mine / f"{name}.bvh"
        path.write_text(spoil(list(lines), name) + "\n" * number)
        if name == "empty":
            path.write_bytes(b"")
        elif name == "binary":
            path.write_bytes(bytes(range(256)) * 20)
    for name, (line, _) in BAD_STATUS.items():
        text = f"{line}\n" if line.startswith("frames") else f"{frames.splitlines()[0]}\n{line}\n"
        (mine.mine / f"{name}_injuries.txt").write_text(text)
    asked = [mine.clip, mine.other, *BAD_CLIPS, *BAD_STATUS]
    text = make(mine, *(f"channels/injury/{name}.npz" for name in asked), ok=False)
    assert "Traceback" not in text
    wanted = {f"motion_clips: .*{name}.bvh": pieces for name, pieces in BAD_CLIPS.items()}
    wanted |= {f"channel_clips: .*{name}_injuries.txt": pieces for name, (_, pieces) in BAD_STATUS.items()}
    for start, pieces in wanted.items():
        (message,) = [line for line in text.splitlines() if re.match(start, line)]
        assert all(piece in message for piece in pieces), message
    made = {path.stem for path in (mine.folder / "results/datasets/mine/channels/injury").glob("*.npz")}
    assert made == {mine.clip, mine.other}


def test_a_missing_data_folder_is_named(mine) -> None:
    text = mine.run("-n", "results/datasets/mine/motion/a.npz", "--config", "mocap=nowhere", ok=False)
    assert "nowhere/mine: no such folder" in text
    assert "mocap=FOLDER" in text


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("training={learning_rate: -1}", "training.learning_rate: input should be greater than 0"),
        ("trainnig={passes: 1}", "trainnig: there is no such key. Allowed here"),
        ("dataset=nope", "nope.yaml: no such file. There are:"),
    ],
)
def test_a_bad_configuration_is_refused_before_planning(workflow, override: str, message: str) -> None:
    text = workflow.run("-np", "results/test/report.html", "--config", override, ok=False)
    assert message in text
    assert "Building DAG" not in text
    assert "Traceback" not in text


@pytest.fixture
def small_disk(workflow) -> Iterator[Path]:
    """The run's results on a small file system of their own. Snakemake's own files are elsewhere, because it
    adds a traceback to our message if it cannot write them.
    """
    results = workflow.folder / "results"
    results.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(results)]
    if subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("this user may not mount a small file system")
    yield results
    subprocess.run(["umount", "-l", str(results)], check=True)


@pytest.mark.slow
def test_a_full_disk_gives_a_message_and_the_next_run_completes(workflow, small_disk: Path) -> None:
    target = "results/datasets/tiny/database/injury"
    text = workflow.run("-c2", target, "--keep-going", ok=False)
    assert "the disk is full" in text
    assert "Traceback" not in text
    assert not list(small_disk.rglob("*.part"))
    whole = {p: p.read_bytes() for p in small_disk.rglob("datasets/tiny/synthetic/*.bvh")}
    subprocess.run(["mount", "-o", "remount,size=300m", str(small_disk)], check=True)
    workflow.run("-c2", target)
    assert {p: p.read_bytes() for p in whole} == whole
