"""Writes results/<configuration>/export/engine/: what a game needs to run the character in its own engine."""

import shutil
import zipfile
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


def write_blender_addon(
    path: str | Path, addon: str | Path, libraries: str | Path, character: str | Path, body: str | Path
) -> None:
    """Write the add-on for Blender as a zip file that Blender installs, with the character.

    addon: the folder of its code. libraries: the folder of `hobble.engine.compile.compile_libraries`.
    character: character.hob. body: character.glb.
    """
    files = {file.name: file for file in Path(addon).iterdir() if file.is_file()}
    # Beside them may be files of the compiler and of the workflow.
    compiled = (file for file in Path(libraries).iterdir() if file.suffix in (".dll", ".dylib", ".so"))
    files |= {f"libraries/{file.name}": file for file in compiled}
    files |= {"hobble_ctypes.py": EXAMPLES / "hobble_ctypes.py"}
    files |= {"character.hob": Path(character), "character.glb": Path(body)}
    with atomic_path(path) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, file in sorted(files.items()):
            # With a fixed time, the same files give the same bytes.
            archive.writestr(
                zipfile.ZipInfo(f"hobble_blender/{name}"), file.read_bytes(), zipfile.ZIP_DEFLATED
            )
