"""Writes results/<configuration>/export/engine/: what a game needs to run the character in its own engine."""

import zipfile
from pathlib import Path

from hobble.core.files import atomic_path, write_bytes
from hobble.engine import EXAMPLES, SOURCES
from hobble.engine.hob import character_bytes
from hobble.engine.traces import FRAMES, SITUATIONS, trace
from hobble.models.network import Network
from hobble.runtime import Runtime


def export_engine(folder: str | Path, network: Network, runtime: Runtime, wasm: str | Path) -> None:
    """Write the runtime in C, character.hob, README.md, examples and golden traces into a folder.

    wasm: the runtime in WebAssembly (`hobble.engine.compile_wasm`), which is copied. Raises
    HobbleError for a network without a skeleton.
    """
    folder = Path(folder)
    write_bytes(folder / "character.hob", character_bytes(network, runtime))
    for name, situation in SITUATIONS.items():
        write_bytes(folder / f"traces/{name}.trace", trace(network, runtime, situation, FRAMES))
    copies = {source: folder / source.name for source in SOURCES.iterdir()}
    copies |= {source: folder / "examples" / source.name for source in EXAMPLES.iterdir() if source.is_file()}
    for source, target in {**copies, Path(wasm): folder / "engine.wasm"}.items():
        write_bytes(target, source.read_bytes())


def write_blender_addon(
    path: str | Path, addon: str | Path, libraries: str | Path, character: str | Path, body: str | Path
) -> None:
    """Write the add-on for Blender as a zip file that Blender installs, with the character.

    addon: the folder of its code. libraries: the folder of `hobble.engine.compile_libraries`.
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
