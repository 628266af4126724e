"""A user's clips, and small projects with them."""

import shutil
from pathlib import Path

import pytest

from tests.checkout import Workflow

DATASET = "skeleton: s\nfolder: mine\nmirror: true\nheld_out: [b]\n"


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
