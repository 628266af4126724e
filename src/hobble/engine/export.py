"""Writes results/<configuration>/export/engine/: what a game needs to run the character in its own engine."""

from __future__ import annotations

import shutil
from pathlib import Path

from hobble.core.files import atomic_path
from hobble.engine.hob import write_character
from hobble.engine.traces import write_traces
from hobble.models.network import Network
from hobble.runtime.options import Runtime

SOURCES = Path(__file__).parent / "c"
EXAMPLES = Path(__file__).parent / "examples"


def export_engine(folder: str | Path, network: Network, runtime: Runtime, wasm: str | Path) -> None:
    """Write the runtime in C, character.hob, README.md, examples and golden traces into a folder.

    wasm: the runtime in WebAssembly (`hobble.engine.compile.compile_wasm`), which is copied. Raises
    HobbleError for a network without a skeleton.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_character(folder / "character.hob", network, runtime)
    write_traces(folder / "traces", network, runtime)
    copies = {source: folder / source.name for source in SOURCES.iterdir()}
    copies[Path(wasm)] = folder / "engine.wasm"
    for source in filter(Path.is_file, EXAMPLES.rglob("*")):
        copies[source] = folder / "examples" / source.relative_to(EXAMPLES)
    for source, target in copies.items():
        if "__pycache__" in source.parts:
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(target) as temporary:
            shutil.copyfile(source, temporary)
