"""Names and paths from strangers stay in their folders and run no code; closed files are named."""

import json
import os
import tempfile
from pathlib import Path
from typing import Any

import pytest
import yaml

from hobble.config.load_configuration import Catalogue
from hobble.core.errors import HobbleError, InputError
from hobble.core.files import write_text
from hobble.motion.skeleton_file import load_skeleton
from hobble.workflow.project import Project, check_targets

from .conftest import SKELETON, outcome, refused, write
from .throws import become_nobody


@pytest.fixture
def catalogue(tmp_path: Path) -> Path:
    """A folder of configurations inside another one, with a configuration outside that must not be
    reachable.
    """
    folder = tmp_path / "checkout/config"
    (folder / "datasets").mkdir(parents=True)
    (folder / "skeletons").mkdir()
    (folder / "skeletons/holden31.yaml").write_bytes(SKELETON.read_bytes())
    write(tmp_path / "checkout/outside.yaml", "secret: 1\n")
    return folder


OUTSIDE = ["../outside", "/etc/passwd", "..", ".", "a/../../outside", "", "a\nb", "~root", "x" * 5000]


@pytest.mark.parametrize("key", ["extends", "dataset", "network_of", "continues"])
def test_a_configuration_names_nothing_outside_its_folder(catalogue: Path, key: str) -> None:
    write(catalogue / "datasets/synthetic.yaml", "skeleton: holden31\nfolder: x\n")
    for name in OUTSIDE:
        value = {"training": {"continues": name}} if key == "continues" else {key: name}
        write(catalogue / "mine.yaml", json.dumps(value))
        with pytest.raises(HobbleError, match="mine") as refusal:
            check_targets(Project(catalogue.parent, {}), ["results/mine/report.html"])
        assert "secret" not in str(refusal.value)


HUGE = {
    "network": {"units": 10**9},
    "training": {"batch": 10**12},
    "evaluation": {"laps": 10**12, "seconds": float("inf")},
}
HUGE_DATA = {
    "synthetic": {"frames": 10**15},
    "motion": {"loops": 10**9, "fps": float("inf")},
    "terrain": {"patches": 10**12, "size": 10**6},
    "database": {"window": 10**9, "step": 10**9},
}


def test_a_huge_configuration_is_refused(catalogue: Path) -> None:
    for section, values in (HUGE | HUGE_DATA).items():
        for key, value in values.items():
            folder = catalogue if section in HUGE else catalogue / "datasets"
            given = {} if section in HUGE else {"skeleton": "holden31", "folder": "mine"}
            write(folder / "mine.yaml", yaml.safe_dump({**given, section: {key: value}}))
            read = Catalogue(catalogue).configuration if section in HUGE else Catalogue(catalogue).dataset
            refused(lambda read=read: read("mine"), "mine.yaml", f"{section}.{key}")


@pytest.mark.parametrize("key", ["folder", "path", "skeleton", "source", "clips", "held_out"])
def test_a_data_set_names_nothing_outside_the_mocap_folder(catalogue: Path, key: str) -> None:
    for value in ("../x", "/etc", "a/../../x", "a\nb", "x" * 5000, "x/" * 900):
        more: dict[str, Any] = {
            "path": {"terrain": {"heightmaps": [{"kind": "file", "path": value}]}},
            "clips": {"clips": {value: None}},
            "held_out": {"held_out": [value]},
        }
        given = {"skeleton": "holden31", "folder": "mine", **more.get(key, {key: value})}
        write(catalogue / "datasets/mine.yaml", json.dumps(given))
        with pytest.raises(HobbleError, match=r"mine\.yaml"):
            Catalogue(catalogue).dataset("mine")


@pytest.mark.parametrize("value", [10**400, "x" * 9000, [1], None, "\x1b[31m"])
def test_a_skeleton_with_an_offset_that_is_no_number_is_refused(tmp_path: Path, value: Any) -> None:
    data = yaml.safe_load(SKELETON.read_text())
    data["joints"]["LHipJoint"]["offset"][1] = value
    path = write(tmp_path / "mine.yaml", yaml.safe_dump(data, sort_keys=False))
    says = r"mine\.yaml, line \d+: (joints LHipJoint offset 1|an integer of 401 characters)"
    with pytest.raises(InputError, match=says) as refusal:
        load_skeleton(path)
    assert len(str(refusal.value)) < 400
    assert str(refusal.value).isprintable()


def test_unsafe_clip_names_are_refused_with_their_folder(catalogue: Path, tmp_path: Path) -> None:
    write(catalogue / "datasets/mine.yaml", "skeleton: holden31\nfolder: mine\n")
    folder = tmp_path / "mocap/mine"
    folder.mkdir(parents=True)
    unsafe = ("<script>", "{clip}", " walk", "walk ", "a\nb", "\x1b[31m", "a\\b", "\u202egpj", "é" * 101)
    for name in unsafe:
        path = write(folder / f"{name}.bvh", "HIERARCHY")
        with pytest.raises(InputError, match="mocap/mine: a clip is called") as refusal:
            _ = Project(catalogue.parent, {"mocap": tmp_path / "mocap"}).dataset("mine").entries
        assert str(refusal.value).isprintable()
        path.unlink()


def test_symbolic_links_are_followed_to_read_but_never_to_write(tmp_path: Path) -> None:
    target = write(tmp_path / "precious", "precious")
    (tmp_path / "result.json").symlink_to(target)
    write_text(tmp_path / "result.json", "new")
    assert target.read_text() == "precious"
    assert (tmp_path / "result.json").read_text() == "new"


@pytest.mark.workflow
def test_no_name_reaches_a_shell(workflow, tiny_bvh: str) -> None:
    (workflow.folder / "config/datasets/mine.yaml").write_text("skeleton: holden31\nfolder: mine\n")
    (workflow.folder / "mocap/mine").mkdir(parents=True)
    names = ('it\'s a "walk" – 走', "$(touch pwned) `touch pwned`", "a; touch pwned & tee pwned #", "-rf *")
    for name in names:
        (workflow.folder / f"mocap/mine/{name}.bvh").write_text(tiny_bvh)
    made = [f"results/datasets/mine/motion/{name}.npz" for name in names]
    workflow.run("-c2", *made, "--config", "mocap=mocap")
    assert all((workflow.folder / path).is_file() for path in made)
    assert not list(workflow.folder.rglob("pwned"))


NEEDED = ("mocap/mine", "mocap/mine/a_injuries.txt", "config/datasets/mine.yaml")


@pytest.mark.skipif(os.getuid() != 0, reason="not root, so that nothing can be read as somebody else")
@pytest.mark.parametrize("closed", [*NEEDED, "config/skeletons/holden31.yaml"])
def test_an_unreadable_file_that_planning_needs_is_named(closed: str) -> None:
    with tempfile.TemporaryDirectory() as folder:  # pytest's own folders are closed for the user `nobody`
        base = Path(folder)
        base.chmod(0o755)
        for path, text in {
            "config/datasets/mine.yaml": "skeleton: holden31\nfolder: mine\n",
            "config/test.yaml": "dataset: mine\nchannels: [injury]\n",
            "config/skeletons/holden31.yaml": SKELETON.read_text(),
            "mocap/mine/a.bvh": "HIERARCHY",
            "mocap/mine/a_injuries.txt": "frames:9\n",
        }.items():
            (base / path).parent.mkdir(parents=True, exist_ok=True)
            (base / path).write_text(text)

        def read() -> None:
            project = Project(base, {"mocap": base / "mocap"})
            check_targets(project, ["results/test/report.html"])
            project.dataset("mine").splits([])

        def read_as_nobody() -> None:
            become_nobody()
            read()

        read()  # imports the modules first, because the user `nobody` may not
        assert outcome(read_as_nobody) == "done"
        (base / closed).chmod(0)
        said = outcome(read_as_nobody)
        assert said.startswith("refused: ")
        assert closed in said
        assert "ermission" in said
