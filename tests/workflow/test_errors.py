"""Bad input in the real workflow gives one message with file and place. Finished files stay."""

import re
from pathlib import Path

import pytest

from tests.checkout import Workflow

pytestmark = pytest.mark.workflow


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


def test_each_bad_file_is_refused_with_its_place_and_the_others_are_made(
    workflow: Workflow, mine: Path
) -> None:
    """One run with a bad clip, a bad status file and a good clip."""
    good, status = (mine / "uneven-1.bvh").read_text(), (mine / "uneven-1_injuries.txt").read_text()
    (mine / "torn.bvh").write_text(good[: len(good) // 2])
    (mine / "wing.bvh").write_text(f"{good}\n")
    (mine / "wing_injuries.txt").write_text(f"{status.splitlines()[0]}\n1-20 LeftWing-LeftTip[5];\n")
    targets = [f"results/datasets/mine/channels/injury/{name}.npz" for name in ("uneven-1", "torn", "wing")]
    said = workflow.run("-c2", *targets, "--keep-going", "--config", "mocap=mocap", ok=False)
    assert "Traceback" not in said
    for start in ("motion_clips: .*torn.bvh, line", "channel_clips: .*wing_injuries.txt.*LeftWing-LeftTip"):
        assert len(re.findall(f"^{start}", said, re.M)) == 1, said
    assert re.search(r"^\d+ of \d+ jobs done in .*, 2 failed:", said, re.M)
    made = (workflow.folder / "results/datasets/mine/channels/injury").glob("*.npz")
    assert [path.stem for path in made] == ["uneven-1"]


def test_a_bad_configuration_is_refused_before_planning(workflow: Workflow) -> None:
    override = "trainnig={passes: 1}"
    text = workflow.run("-np", "results/test/report.html", "--config", override, ok=False)
    assert "trainnig: there is no such key. Allowed here" in text
    assert "Building DAG" not in text
    assert "Traceback" not in text
