"""The commands and configurations in README and docs work as they stand."""

import re
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from hobble.cli.__main__ import main
from hobble.config.load_configuration import Catalogue
from tests.conftest import ROOT
from tests.snippets import blocks

PLACEHOLDER = re.compile(r"\b(FOLDER|TARGET)\b")
FILE = re.compile(r"config/(?:datasets/)?(\w+)\.yaml")


def lines() -> list[list[str]]:
    """The words of each command that is run, each once."""
    found: dict[tuple[str, ...], None] = {}
    for block in blocks(ROOT, "sh"):
        if block.run:
            for line in block.text.replace("\\\n", " ").splitlines():
                found[tuple(shlex.split(line, comments=True))] = None
    return [list(words) for words in found if words]


def program(words: list[str]) -> str:
    name = words[0].rpartition("/")[2]
    return words[2].replace("hobble.", "hobble ") if words[:2] == ["python", "-m"] else name


def write_configurations(root: Path, checkout: Path) -> list[tuple[str, str]]:
    """Write each YAML block to the file that the text names last. Returns kind and name of each."""
    written = []
    for number, block in enumerate(blocks(root, "yaml")):
        *_, match = FILE.finditer(f"{block.above[-600:]}{block.text}")
        kind = "dataset" if "datasets/" in match[0] else "configuration"
        path, text = checkout / match[0], block.text
        if path.is_file() and not text.startswith(("skeleton:", "extends:")):
            path, text = path.with_stem(f"{path.stem}-{number}"), f"extends: {path.stem}\n{text}"
        path.write_text(text)
        written.append((kind, path.stem))
    return written


def test_every_configuration_is_valid(root: Path, tmp_path: Path) -> None:
    shutil.copytree(root / "config", tmp_path / "config")
    written = write_configurations(root, tmp_path)
    catalogue = Catalogue(tmp_path / "config")
    for kind, name in written:
        getattr(catalogue, kind)(name)
    assert {("dataset", "mine"), ("configuration", "mine")} <= set(written)


def test_make_has_every_target(root: Path) -> None:
    for words in lines():
        if program(words) == "make":
            done = subprocess.run([words[0], "-n", *words[1:]], cwd=root, capture_output=True, text=True)
            assert done.returncode == 0, f"{words}: {done.stderr}"


@pytest.mark.workflow
@pytest.mark.slow
def test_every_command_of_hobble_runs(
    finished, clips: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for folder in ("FOLDER", "CAPTURED", "data/mine"):
        Path(folder).mkdir(parents=True)
        shutil.copy(clips[1], Path(folder, "walk.bvh"))
    for name in ("HURT", "HEALTHY"):
        shutil.copy(clips[1], f"{name}.bvh")
    Path("results").mkdir()
    for name in ("mine", "limp"):
        Path("results", name).symlink_to(finished.folder / "results/test")
    monkeypatch.setattr("webbrowser.open", lambda address: True)
    ran = 0
    for words in lines():
        if program(words).startswith("hobble"):
            asked = [*program(words).split()[1:], *words[3 if words[0] == "python" else 1 :]]
            assert main(asked) == 0, words
            ran += 1
    assert ran >= 4


@pytest.mark.workflow
@pytest.mark.slow
def test_every_workflow_can_be_planned(root: Path, workflow, clips: list[Path]) -> None:
    """Runs of hours are planned only, with -n. A command with FOLDER needs the reader's data."""
    write_configurations(root, workflow.folder)
    (workflow.folder / "data/mine").mkdir(parents=True)
    for number in range(3):
        text = clips[1].read_bytes() + b"\n" * number
        (workflow.folder / f"data/mine/walk-{number}.bvh").write_bytes(text)
    planned = 0
    for words in lines():
        if program(words) == "snakemake" and not PLACEHOLDER.search(" ".join(words)):
            graph = any(word in ("--rulegraph", "--dag") for word in words)
            workflow.run(*([] if graph else ["-n"]), *words[1:])
            planned += 1
    assert planned >= 8
