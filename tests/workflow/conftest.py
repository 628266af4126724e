"""Runs the real workflow on tiny data in a copy of the checkout, which tests may change."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.workflow.small_project import DATASET


@dataclass
class Workflow:
    """A clone of the checkout in which the commands of the README run."""

    checkout: Path

    @property
    def folder(self) -> Path:
        """The folder of the run: the checkout itself, the default."""
        return self.checkout

    def command(self, *arguments: str) -> list[str]:
        """The command of the README, `snakemake -c2 results/...`, without other options."""
        return [str(Path(sys.executable).with_name("snakemake")), *arguments]

    def start(self, *arguments: str, said: Path | None = None) -> subprocess.Popen[bytes]:
        """Start it in its own session without waiting. Its output goes to the file `said`."""
        with open(said or os.devnull, "wb") as out:
            return subprocess.Popen(
                self.command(*arguments),
                cwd=self.checkout,
                env=self.environment(),
                stdout=out,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )

    def environment(self) -> dict[str, str]:
        path = os.pathsep.join([str(self.checkout / "src"), os.environ.get("PYTHONPATH", "")])
        return {**os.environ, "PYTHONPATH": path.rstrip(os.pathsep), "PYTHONDONTWRITEBYTECODE": "1"}

    def run(self, *arguments: str, ok: bool = True) -> str:
        """Run snakemake and return stdout and stderr. Fails the test if its success is not `ok`."""
        done = subprocess.run(
            self.command(*arguments),
            cwd=self.checkout,
            env=self.environment(),
            capture_output=True,
            text=True,
            timeout=600,
        )
        text = done.stdout + done.stderr
        assert (done.returncode == 0) is ok, text
        return text

    def planned(self, *arguments: str) -> dict[str, int]:
        """Rule -> number of jobs that a dry run plans."""
        text = self.run("-n", *arguments)
        table = re.search(r"^Job stats:\n(.*?)\ntotal", text, re.M | re.S)
        rows = re.findall(r"^\w+ +(\w+) +(\d+) ", table[1], re.M) if table else []
        return {rule: int(count) for rule, count in rows}

    def edit(self, file: str, old: str, new: str) -> None:
        path = self.checkout / file
        text = path.read_text()
        assert old in text, f"{file} has no {old!r}"
        path.write_text(text.replace(old, new, 1))

    def own_source(self) -> Path:
        """Make the package a copy that may be edited, and return its folder."""
        source = self.checkout / "src"
        real = source.resolve()
        source.unlink()
        shutil.copytree(real, source, ignore=shutil.ignore_patterns("__pycache__"))
        return source / "hobble"


def copy_of(root: Path, folder: Path) -> Workflow:
    """Rules are copied and the package is linked, so that numba's cache is found."""
    checkout = folder / "checkout"
    checkout.mkdir(parents=True)
    shutil.copy2(root / "Snakefile", checkout)
    for part in ("config", "profiles", "workflow"):
        shutil.copytree(root / part, checkout / part)
    (checkout / "src").symlink_to(root / "src")
    return Workflow(checkout)


@pytest.fixture
def workflow(root: Path, tmp_path: Path) -> Workflow:
    """A fresh copy with no results."""
    return copy_of(root, tmp_path)


RUN = "results/test/report.html"
LIMIT = 1200  # seconds that the shared run may take


def shared_folder(config: pytest.Config) -> Path:
    """A folder that all processes of this session of pytest share."""
    base = config._tmp_path_factory.getbasetemp()  # type: ignore[attr-defined]
    return (base.parent if hasattr(config, "workerinput") else base) / "shared"


def pytest_collection_finish(session: pytest.Session) -> None:
    """Start the run of `test` that many tests look at, once for all processes, while other tests run."""
    worker = getattr(session.config, "workerinput", {}).get("workerid", "gw0")
    wanted = {"finished", "copied", "clips"}
    if worker != "gw0" or not any(wanted & set(getattr(i, "fixturenames", ())) for i in session.items):
        return
    folder = shared_folder(session.config)
    made = copy_of(ROOT, folder)
    script = '"$@" > said 2>&1; echo $? > status.part; mv status.part status'
    command = ["sh", "-c", script, "sh", *made.command("-c2", RUN, "-d", str(made.checkout))]
    command += ["-s", str(made.checkout / "Snakefile")]
    subprocess.Popen(command, cwd=folder, env=made.environment())


@pytest.fixture(scope="session")
def finished(request: pytest.FixtureRequest) -> Workflow:
    """The finished run of configuration `test`. Tests must not change it."""
    folder, began = shared_folder(request.config), time.monotonic()
    while not (folder / "status").exists():
        assert time.monotonic() < began + LIMIT, (folder / "said").read_text()
        time.sleep(0.2)
    assert (folder / "status").read_text() == "0\n", (folder / "said").read_text()
    return Workflow(folder / "checkout")


@pytest.fixture
def copied(finished: Workflow, tmp_path: Path) -> Workflow:
    """A copy of the finished run that a test may change. File times are kept, so nothing is out of date."""
    target = tmp_path / "copy"
    shutil.copytree(finished.checkout, target / "checkout", symlinks=True)
    return Workflow(target / "checkout")


@pytest.fixture(scope="session")
def clips(finished: Workflow, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two good clips with their label and status files."""
    folder = tmp_path_factory.mktemp("clips")
    names = ("uneven-1", "walk-straight-1")
    for name in names:
        for file in (finished.folder / "results/datasets/tiny/synthetic").glob(f"{name}[._]*"):
            shutil.copy(file, folder)
    status = "frames:786\n100-400 LeftLeg-LeftFoot[3];\n401-786 LeftLeg-LeftFoot[10];\n"
    (folder / "uneven-1_injuries.txt").write_text(status)
    return [folder / f"{name}.bvh" for name in names]


@pytest.fixture
def base(tmp_path: Path) -> Path:
    """A checkout with one configuration and a data set of three clips, one hurt by its status file."""
    (tmp_path / "config/datasets").mkdir(parents=True)
    (tmp_path / "config/one.yaml").write_text("dataset: mine\n")
    (tmp_path / "config/hurt.yaml").write_text("extends: one\nchannels: [injury]\n")
    (tmp_path / "config/datasets/mine.yaml").write_text(DATASET)
    folder = tmp_path / "data/mine"
    folder.mkdir(parents=True)
    for name in ("a", "b", "c", "a_mirror"):
        (folder / f"{name}.bvh").write_text("")
    (folder / "c_injuries.txt").write_text("frames:9\n1-9 LeftLeg-LeftFoot[4];\n")
    (folder / "a_injuries.txt").write_text("frames:9\n")
    (folder / "b_gait.txt").write_text("1 walk\n")
    return tmp_path


@pytest.fixture
def complete(base: Path, root: Path) -> Path:
    """The checkout `base` with the skeleton that its data set names."""
    (base / "config/skeletons").mkdir()
    shutil.copy(root / "config/skeletons/holden31.yaml", base / "config/skeletons/s.yaml")
    return base
