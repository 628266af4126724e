"""Names and paths from strangers stay in their folders and run no code; closed files are named."""

import json
import os
import tempfile
from pathlib import Path
from typing import Any

import pytest

from hobble.config.load_configuration import Catalogue
from hobble.core.errors import HobbleError, InputError
from hobble.workflow.project import Project, check_targets

from .conftest import SKELETON, outcome, write
from .throws import become_nobody


@pytest.fixture
def catalogue(tmp_path: Path) -> Path:
    """A folder of configurations, with a configuration outside that must not be reachable."""
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
