"""Example inputs, and the page made of them, once for all tests."""

from __future__ import annotations

import fcntl
import hashlib
import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from hobble.core.errors import HobbleError
from hobble.core.skeleton import Skeleton
from hobble.engine.compile import compile_wasm
from hobble.engine.export import SOURCES
from hobble.models.load import load_network
from hobble.models.network import Network
from hobble.report.bundle import WEB, bundle_page_scripts, install_npm_packages
from hobble.report.character import opening_slider, playable_data
from hobble.report.gather import ReportMaterial, gather
from hobble.report.page import render_report
from hobble.report.recorded_motion import packed_comparisons, packed_scenes


def load_module(name: str) -> ModuleType:
    """Imports a module of this folder, which is not a package."""
    path = Path(__file__).with_name(f"{name}.py")
    spec = importlib.util.spec_from_file_location(f"report_{name}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[f"report_{name}"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def examples() -> ModuleType:
    """The generators of made-up artefacts."""
    return load_module("examples")


@pytest.fixture(scope="session")
def tools() -> ModuleType:
    """The browser."""
    return load_module("browser")


@pytest.fixture(scope="session")
def pictures(root: Path) -> Path:
    """The folder in which pictures of the page's sections are saved for people to look at; not tracked."""
    folder = root / "build" / "report-sections"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def inputs(
    examples: ModuleType, holden31: Skeleton, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    """Paths of a whole set of inputs: those of `gather`, and `scenarios`."""
    folder = tmp_path_factory.mktemp("inputs")
    arguments = examples.write_all(folder, holden31)
    return {"gather": arguments, "scenarios": folder / "scenarios.npz", "folder": folder}


@pytest.fixture(scope="session")
def material(inputs: dict[str, Any]) -> ReportMaterial:
    return gather(**inputs["gather"])


@pytest.fixture(scope="session")
def play(inputs: dict[str, Any], material: ReportMaterial) -> dict[str, Any]:
    return packed_scenes(inputs["scenarios"], material.network["skeleton"])


@pytest.fixture(scope="session")
def network(inputs: dict[str, Any]) -> Network:
    """The small untrained network of the examples."""
    return load_network(inputs["gather"]["weights"])


@pytest.fixture(scope="session")
def character(network: Network, examples: ModuleType) -> dict[str, Any]:
    return playable_data(network, examples.RUNTIME)


@pytest.fixture(scope="session")
def hero(character: dict[str, Any], material: ReportMaterial) -> dict[str, Any]:
    """The slider that is set at the top of the page."""
    return opening_slider(character, material.measurements.values())


@pytest.fixture(scope="session")
def compared(
    network: Network, examples: ModuleType, holden31: Skeleton, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("rows")
    paths = [examples.rows(folder / f"{clip}.npz", holden31) for clip in ("jog", "walk_turns")]
    return packed_comparisons(network, paths, {"jog": "train", "walk_turns": "held_out"})


@pytest.fixture(scope="session")
def modules(tmp_path_factory: pytest.TempPathFactory) -> Path | None:
    """The page's npm packages, fetched once for all workers; None if they cannot be fetched."""
    lock = (WEB / "package-lock.json").read_bytes()
    shared = tmp_path_factory.getbasetemp().parent / f"page-{hashlib.sha256(lock).hexdigest()[:12]}"
    shared.mkdir(exist_ok=True)
    with open(shared / "lock", "w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        if not (shared / "done").exists():
            try:
                install_npm_packages(shared)
            except HobbleError:
                return None
            (shared / "done").touch()
    return shared / "node_modules"


@pytest.fixture(scope="session")
def wasm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The runtime in WebAssembly, compiled once for all workers."""
    made_of = b"".join(path.read_bytes() for path in sorted(SOURCES.glob("*.[ch]")))
    digest = hashlib.sha256(made_of).hexdigest()[:12]
    shared = tmp_path_factory.getbasetemp().parent / f"engine-{digest}.wasm"
    with open(f"{shared}.lock", "w") as held:
        fcntl.flock(held, fcntl.LOCK_EX)
        if not shared.exists():
            compile_wasm(shared)
    return shared


@pytest.fixture(scope="session")
def script(modules: Path | None, wasm: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The page's scripts, bundled; "" if the packages cannot be fetched (then no browser opens the page)."""
    if modules is None:
        return ""
    target = tmp_path_factory.mktemp("bundle") / "bundle.js"
    bundle_page_scripts(modules, wasm, target)
    return target.read_text(encoding="utf-8")


@pytest.fixture(scope="session")
def page(
    material: ReportMaterial,
    play: dict[str, Any],
    character: dict[str, Any],
    compared: dict[str, Any],
    script: str,
    hero: dict[str, Any],
) -> str:
    """The report of the examples."""
    return render_report(material, play, character, compared, script, hero)


@pytest.fixture(scope="session")
def tab(page: str, tools: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """The example's page, open in a browser, for the tests of all modules."""
    yield from tools.opened(page, tmp_path_factory.mktemp("play"))
