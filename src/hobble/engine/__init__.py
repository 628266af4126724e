"""The character for game engines in other languages: a runtime in C (`c/`), and the files that go with it.

This file compiles it with zig, a compiler that is a Python package, so that every machine has one.
"""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from hobble.core.errors import HobbleError
from hobble.core.files import atomic_path

SOURCES = Path(__file__).parent / "c"
EXAMPLES = Path(__file__).parent / "examples"
# A module without a main function, with vectors of 128 bits, without debug information.
WASM_OPTIONS = (
    *("-target", "wasm32-wasi", "-mexec-model=reactor", "-O3", "-msimd128", "-s"),
    *("-Wl,--export-dynamic", "-Wl,--export=__heap_base", "-Wl,-z,stack-size=1048576"),
)
WASM_SOURCES = tuple(SOURCES / name for name in ("hobble.c", "hobble_gait.c", "hobble_web.c"))

# The runtime as a library for other programs: name of the file -> target of the compiler.
LIBRARIES = {
    "windows-x64.dll": "x86_64-windows-gnu",
    "macos-arm64.dylib": "aarch64-macos",
    "macos-x64.dylib": "x86_64-macos",
    "linux-x64.so": "x86_64-linux-gnu.2.17",
    "linux-arm64.so": "aarch64-linux-gnu.2.17",
}


def compile_c(sources: Sequence[str | Path], target: str | Path, options: Sequence[str]) -> None:
    """Compile C files into the file `target`. Raises HobbleError with what the compiler says."""
    with atomic_path(target) as temporary:
        arguments = [*options, *map(str, sources), "-o", str(temporary), "-lm"]
        command = [sys.executable, "-m", "ziglang", "cc", f"-I{SOURCES}", *arguments]
        process = subprocess.run(command, capture_output=True, text=True, check=False)
        if "No module named ziglang" in process.stderr:
            raise HobbleError(f"{target}: there is no compiler. Install it with: pip install ziglang")
        if process.returncode:
            raise HobbleError(f"{target}: the compiler says: {process.stderr.strip()[:1000]}")


def compile_wasm(target: str | Path) -> None:
    """Compile the runtime to WebAssembly. The first time takes half a minute: zig builds its C library."""
    compile_c(WASM_SOURCES, target, WASM_OPTIONS)


def compile_libraries(folder: str | Path) -> None:
    """Compile the runtime to a shared library for each of LIBRARIES."""
    for name in LIBRARIES:
        compile_library(Path(folder) / name)


def compile_library(target: Path) -> None:
    """Compile the runtime to a shared library. The file's name is one of LIBRARIES."""
    system = LIBRARIES[target.name]
    processor = ["-mcpu=x86_64_v2"] if system.startswith("x86_64") else []
    options = ["-target", system, *processor, "-O3", "-shared", "-fPIC", "-s"]
    compile_c([SOURCES / "hobble.c"], target, options)
