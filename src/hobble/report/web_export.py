"""Exports a trained character for use in any web page: an ES module, its network, and an example page."""

from __future__ import annotations

import shutil
from pathlib import Path

from hobble.core.errors import HobbleError
from hobble.core.files import atomic_path, write_json
from hobble.figure.pack import packed_body
from hobble.models.network import Network
from hobble.report.bundle import WEB, bundle_module
from hobble.report.playable import playable_data
from hobble.runtime.options import Runtime

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
