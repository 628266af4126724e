"""Which clips a configuration gets, in which split, and from which files."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from hobble.core.errors import HobbleError
from hobble.workflow.project import Project

DATASET = """
skeleton: s
folder: mine
mirror: true
held_out: [b]
"""


@pytest.fixture
def base(tmp_path: Path) -> Path:
    """A checkout with one configuration and a data set of three clips, one hurt by its status file."""
    (tmp_path / "config/datasets").mkdir(parents=True)
    (tmp_path / "config/one.yaml").write_text("dataset: mine\n")
    (tmp_path / "config/hurt.yaml").write_text("extends: one\ninjury: true\n")
    (tmp_path / "config/datasets/mine.yaml").write_text(DATASET)
    folder = tmp_path / "data/mine"
    folder.mkdir(parents=True)
    for name in ("a", "b", "c", "a_mirror"):
        (folder / f"{name}.bvh").write_text("")
    (folder / "c_injuries.txt").write_text("frames:9\n1-9 LeftLeg-LeftFoot[4];\n")
    (folder / "a_injuries.txt").write_text("frames:9\n")
    (folder / "b_gait.txt").write_text("1 walk\n")
    return tmp_path


def test_mirrors_go_with_their_originals_and_hurt_clips_to_injured_networks(base: Path) -> None:
    project = Project(base, {})
    healthy = {"a": "train", "a_mirror": "train", "b": "held_out", "b_mirror": "held_out"}
    assert project.splits("one") == healthy
    assert project.splits("hurt") == {**healthy, "c": "train", "c_mirror": "train"}
    assert project.database("one").endswith("mine/database/healthy")
    assert project.database("hurt").endswith("mine/database/all")


def test_files_beside_a_clip_are_found_and_no_others(base: Path) -> None:
    project = Project(base, {})
    assert [Path(f).name for f in project.label_files("mine", "b")] == ["b_gait.txt"]
    assert project.label_files("mine", "c") == []
    assert [Path(f).name for f in project.status_files("mine", "c")] == ["c_injuries.txt"]


def test_a_status_in_the_configuration_takes_the_place_of_the_file(base: Path) -> None:
    text = DATASET + "clips: {a: , b: , c: {status: 'LeftArm-LeftForeArm[3]'}}\n"
    (base / "config/datasets/mine.yaml").write_text(text)
    assert Project(base, {}).status_files("mine", "c") == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (DATASET + "clips: {b: , a_mirror: }\n", "a_mirror: a mirror is made from its original"),
        ("skeleton: s\nfolder: mine\nheld_out: [z]\n", "held_out names no clip: z"),
        ("skeleton: s\nfolder: mine\nheld_out: [a, b, c]\n", "no healthy clip is left to train on"),
        ("skeleton: s\nfolder: empty\n", "empty: no such folder"),
    ],
)
def test_a_data_set_that_cannot_work_is_told(base: Path, text: str, message: str) -> None:
    (base / "config/datasets/mine.yaml").write_text(text)
    with pytest.raises(HobbleError, match=message):
        Project(base, {}).splits("one")


def test_a_listed_clip_without_its_file_is_told(base: Path) -> None:
    (base / "config/datasets/mine.yaml").write_text(DATASET + "clips: {a: , b: , gone: }\n")
    with pytest.raises(HobbleError, match=r"gone\.bvh: no such file"):
        Project(base, {}).source("mine", "gone")


def test_the_walkers_frames_are_shared_out(root: Path) -> None:
    project = Project(root, {})
    total = sum(project.frames("synthetic", clip) for clip in project.clips("synthetic"))
    assert abs(total - 20_000) < 20


def test_networks_that_others_make_are_read_where_they_lie(root: Path) -> None:
    project = Project(root, {})
    assert project.network("ava-m", "weights.npz") == "results/ava/network/weights.npz"
    assert project.start("holden-xt") == ["results/holden/network/checkpoint.npz"]
    assert project.start("holden") == []


@pytest.fixture
def complete(base: Path, root: Path) -> Path:
    """The same, with the skeleton that the data set names."""
    (base / "config/skeletons").mkdir()
    shutil.copy(root / "config/skeletons/holden31.yaml", base / "config/skeletons/s.yaml")
    return base


def test_what_is_compared(complete: Path) -> None:
    base = complete
    project = Project(base, {"compare": ["one", "hurt"]})
    project.check(["results/compare/compare.json"])
    assert project.measured()["accuracy"] == [
        f"results/{n}/evaluation/accuracy.json" for n in ("one", "hurt")
    ]
    assert Project(base, {"compare": "one,hurt"}).compared() == ["one", "hurt"]
    (base / "config/read.yaml").write_text("extends: one\nnetwork_of: one\n")
    read = Project(base, {"compare": ["read"]}).measured()
    assert read["history"] == ["results/one/network/history.csv"]
    # A list of configurations is no part of any of them.
    assert project.resolved("one") == Project(base, {}).resolved("one")


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["one", "two"], "two.yaml: no such file. There are: hurt, one"),
        (["one", "one"], "each configuration once"),
        ([], "one or more, not none"),
        ([1], "a list of configurations"),
        ({"a": "one"}, "a list of configurations"),
    ],
)
def test_what_cannot_be_compared(complete: Path, names: object, message: str) -> None:
    project = Project(complete, {"compare": names})
    project.check(["results/one/report.html"])
    with pytest.raises(HobbleError, match=message):
        project.check(["results/compare/report.html"])


@pytest.mark.parametrize("name", ["compare", "datasets"])
def test_folders_of_results_are_no_configurations(base: Path, name: str) -> None:
    (base / f"config/{name}.yaml").write_text("extends: one\n")
    with pytest.raises(HobbleError, match=f"no configuration can be called {name}"):
        Project(base, {})
