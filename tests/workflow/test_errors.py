"""Bad input in the real workflow gives one message with file and place. Finished files stay."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

from tests.checkout import Workflow

pytestmark = pytest.mark.workflow

# A figure of one bone, whatever its joints are called.
STICK = (
    "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\n"
    "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    "End Site\n{\nOFFSET 0 90 0\n}\n}\nMOTION\nFrames: 200\nFrame Time: 0.0083333\n" + "0 90 0 0 0 0\n" * 200
)


@pytest.fixture
def mine(clips: list[Path], workflow: Workflow) -> Path:
    """The folder of a user's data set with two clips: uneven-1 and walk-straight-1."""
    folder = workflow.folder / "mocap/mine"
    folder.mkdir(parents=True)
    for path in clips:
        for file in path.parent.glob(f"{path.stem}[._]*"):
            (folder / file.name).write_bytes(file.read_bytes())
    (workflow.folder / "config/datasets/mine.yaml").write_text("skeleton: holden31\nfolder: mine\n")
    return folder


def on_a_terminal(workflow: Workflow, *arguments: str) -> tuple[int, str]:
    """Exit status and output of a run in a pseudo-terminal, where the line of progress is overwritten."""
    ours, theirs = os.openpty()
    command = workflow.command(*arguments)
    process = subprocess.Popen(command, **workflow.how(), stdout=theirs, stderr=theirs)
    os.close(theirs)
    said = b""
    try:
        while block := os.read(ours, 65536):
            said += block
    except OSError:
        pass  # the other side is closed
    return process.wait(), said.decode()


def test_each_bad_file_is_refused_with_its_place_and_the_others_are_made(
    workflow: Workflow, mine: Path
) -> None:
    """One run with three bad clips, two bad status files and two good clips."""
    good, status = (mine / "uneven-1.bvh").read_text(), (mine / "uneven-1_injuries.txt").read_text()
    frames = status.splitlines()[0]
    files = {
        "torn.bvh": good[: len(good) // 2],
        "stick.bvh": STICK,
        "binary.bvh": "\0\1\2" * 999,
        "wing.bvh": f"{good}\n",
        "wing_injuries.txt": f"{frames}\n1-20 LeftWing-LeftTip[5];\n",
        "back.bvh": f"{good}\n\n",
        "back_injuries.txt": f"{frames}\n20-1 LeftUpLeg-LeftLeg[5];\n",
    }
    for name, text in files.items():
        (mine / name).write_text(text)
    asked = ["uneven-1", "walk-straight-1", *(Path(name).stem for name in files if name.endswith(".bvh"))]
    targets = [f"results/datasets/mine/channels/injury/{name}.npz" for name in asked]
    ended, said = on_a_terminal(workflow, "-c2", *targets, "--keep-going", "--config", "mocap=mocap")
    assert ended == 1
    assert "Traceback" not in said
    lines = [line.rpartition("\x1b[K")[2] for line in said.splitlines()]
    for start, piece in {
        "motion_clips: .*torn.bvh": "line",
        "motion_clips: .*stick.bvh": "",
        "motion_clips: .*binary.bvh": "",
        "channel_clips: .*wing_injuries.txt": "LeftWing-LeftTip",
        "channel_clips: .*back_injuries.txt": "20-1",
    }.items():
        (message,) = [line for line in lines if re.match(start, line)]
        assert piece in message, message
    assert re.search(r"^\d+ of \d+ jobs done in .*, 5 failed:", "\n".join(lines), re.M)
    made = {path.stem for path in (workflow.folder / "results/datasets/mine/channels/injury").glob("*.npz")}
    assert made == {"uneven-1", "walk-straight-1"}


def test_a_plan_takes_few_lines_and_all_of_snakemakes_with_p(workflow: Workflow, mine: Path) -> None:
    target = "results/datasets/tiny/channels/injury/walk-straight-1.npz"
    assert len(workflow.run("-n", target).splitlines()) < 20
    assert "rule synthetic_clips:" in workflow.run("-np", target)
    text = workflow.run("-n", "results/datasets/mine/motion/a.npz", "--config", "mocap=nowhere", ok=False)
    assert "nowhere/mine: no such folder" in text
    assert "mocap=FOLDER" in text


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("training={learning_rate: -1}", "training.learning_rate: input should be greater than 0"),
        ("trainnig={passes: 1}", "trainnig: there is no such key. Allowed here"),
    ],
)
def test_a_bad_configuration_is_refused_before_planning(workflow, override: str, message: str) -> None:
    text = workflow.run("-np", "results/test/report.html", "--config", override, ok=False)
    assert message in text
    assert "Building DAG" not in text
    assert "Traceback" not in text
