"""Clips with awkward names, and files that may not be read, through the real workflow."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from hobble.core.errors import HobbleError
from hobble.workflow.project import Project
from hobble.workflow.targets import check_targets

from .judging import TRACEBACK
from .lab import Lab
from .texts import SKELETON
from .throws import become_nobody

pytestmark = pytest.mark.workflow
DATASET = "skeleton: holden31\nfolder: mine\n"
NAMES = (
    'it\'s a "walk" – 走',
    "$(touch pwned) `touch pwned`",
    "a; touch pwned & touch pwned | tee pwned #",
    "-rf *",
)


@pytest.fixture
def lab(tmp_path: Path) -> Lab:
    """A checkout with a user's data set whose clips are in run/mocap/mine."""
    made = Lab(tmp_path / "lab")
    (made.run / "config/datasets/mine.yaml").write_text(DATASET)
    (made.run / "mocap/mine").mkdir(parents=True)
    return made


def run(lab: Lab, *arguments: str) -> tuple[int, str]:
    end = lab.snakemake(lab.run, *arguments, "--config", "mocap=mocap")
    assert TRACEBACK not in end.said
    assert not list(lab.run.rglob("pwned"))
    return end.status, end.said


def test_no_name_reaches_a_shell(lab: Lab, tiny_bvh: str) -> None:
    for name in NAMES:
        (lab.run / f"mocap/mine/{name}.bvh").write_text(tiny_bvh)
    made = [f"results/datasets/mine/motion/{name}.npz" for name in NAMES]
    status, said = run(lab, "-c2", *made)
    assert status == 0, said
    assert all((lab.run / path).is_file() for path in made)


@pytest.fixture
def reachable() -> Iterator[Path]:
    """A folder into which the user with that name cannot go."""
    if os.getuid():
        pytest.skip("not root, so that nothing can be read as somebody else")
    with tempfile.TemporaryDirectory(prefix="reachable-") as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


def as_nobody(read: Callable[[], object]) -> str:
    """The message of `read` if it runs as a user without special permissions."""
    read_end, write_end = os.pipe()
    pid = os.fork()
    if not pid:
        try:
            become_nobody()
            said = f"read: {read()}"
        except HobbleError as error:
            said = str(error)
        except BaseException as error:
            said = f"{TRACEBACK}: {error!r}"
        os.write(write_end, said.encode())
        os._exit(0)
    os.close(write_end)
    with os.fdopen(read_end) as pipe:
        said = pipe.read()
    os.waitpid(pid, 0)
    return said


@pytest.mark.parametrize(
    "closed",
    [
        "mocap/mine",
        "mocap/mine/a_injuries.txt",
        "config/datasets/mine.yaml",
        "config/skeletons/holden31.yaml",
    ],
)
def test_an_unreadable_file_that_planning_needs_is_named(reachable: Path, closed: str) -> None:
    for path, text in {
        "config/datasets/mine.yaml": DATASET,
        "config/test.yaml": "dataset: mine\nchannels: [injury]\n",
        "config/skeletons/holden31.yaml": SKELETON.read_text(),
        "mocap/mine/a.bvh": "HIERARCHY",
        "mocap/mine/a_injuries.txt": "frames:9\n",
    }.items():
        (reachable / path).parent.mkdir(parents=True, exist_ok=True)
        (reachable / path).write_text(text)

    def read() -> object:
        project = Project(reachable, {"mocap": reachable / "mocap"})
        check_targets(project, ["results/test/report.html"])
        return project.datasets.splits("mine", [])

    read()  # imports the modules first, because the user `nobody` may not
    assert as_nobody(read).startswith("read: ")
    (reachable / closed).chmod(0)
    said = as_nobody(read)
    assert closed in said
    assert "ermission" in said
    assert TRACEBACK not in said
