"""The page of the finished run of `test`, open in a browser, and what it was made of."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hobble.core.clip import load_clip
from hobble.measures.measure import all_measures
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.report.character import playable_data
from hobble.report.gather import ReportMaterial, gather
from hobble.runtime import Runtime
from tests.checkout import Workflow
from tests.report.browser import Browser, opened

CLIP, HURT = "walk-straight-1", "walk-straight-2_hurt1"  # clips of the run


@pytest.fixture(scope="session")
def results(finished: Workflow) -> Path:
    """The folder of the results of the run. Tests must not change it."""
    return finished.folder / "results"


@pytest.fixture(scope="session")
def material(results: Path) -> ReportMaterial:
    """What the page of the run was made of."""
    data, own = results / "datasets/tiny", results / "test"

    def of_clips(pattern: str) -> list[str]:
        return sorted(map(str, data.glob(pattern)))

    made = gather(
        name="test",
        dataset="tiny",
        title=None,
        splits={"walk-straight-2": "held_out", HURT: "held_out"},
        configuration=own / "configuration.yaml",
        measurements=sorted((own / "evaluation").glob("*.json")),
        pipeline=own / "pipeline.json",
        history=own / "network/history.csv",
        weights=own / "network/weights.npz",
        motion=of_clips("motion/*.json"),
        labels=of_clips("labels/*.json"),
        channels=of_clips("channels/*/*.json"),
        terrain=of_clips("terrain/clips/*.npz"),
        rows=of_clips("database/clips/*.npz"),
        measures=all_measures(),
    )
    assert made.row_files
    return made


@pytest.fixture(scope="session")
def runtime(material: ReportMaterial) -> Runtime:
    """The options of the character at run time."""
    return Runtime.model_validate(material.resolved["configuration"]["runtime"])


@pytest.fixture(scope="session")
def network(results: Path) -> Network:
    return load_network(results / "test/network/weights.npz")


@pytest.fixture(scope="session")
def character(network: Network, runtime: Runtime) -> dict[str, Any]:
    return playable_data(network, runtime)


@pytest.fixture(scope="session")
def walk(results: Path) -> np.ndarray:
    """(F, J, 3) joints of a clip that walks straight on, cm, 60 Hz."""
    return load_clip(results / f"datasets/tiny/motion/{CLIP}.npz").positions[120:360]


@pytest.fixture(scope="session")
def modules(results: Path) -> Path:
    """The npm packages of the page."""
    return results / "page/node_modules"


@pytest.fixture(scope="session")
def script(results: Path) -> str:
    """The scripts of the page."""
    return (results / "page/bundle.js").read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def page(results: Path) -> str:
    return (results / "test/report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def tab(page: str, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """The page, open in a browser, for the tests of all modules."""
    yield from opened(page, tmp_path_factory.mktemp("play"))
